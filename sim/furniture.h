// The things a lab is furnished with. Each stands with the middle of its underside on the frame's
// origin and faces −x.
#pragma once

#include <bitset>
#include <cstdint>
#include <string>
#include <vector>

#include "sim/random.h"
#include "sim/scene.h"

namespace foresight::sim {

/// Indices of the textures that the lab's things share, painted once.
struct Palette {
  int white = 0, led = 0, desk_wood = 0, shelf_wood = 0, dark_metal = 0, dark_plastic = 0,
      grey_plastic = 0;
  int brick = 0, plaster = 0, floor = 0, ceiling = 0, fabric = 0, clay = 0;
  int cardboard = 0, cardboard_printed = 0, page_edges = 0, checkerboard = 0, screen = 0;
  int keyboard = 0, whiteboard = 0, notes = 0;
  std::vector<int> pages, letters, posters, landscapes, abstracts, spines, covers, labels, leaves,
      panels;
};
Palette paint_palette(uint64_t seed, Scene& scene);

/// Collects things into a scene.
class Furnisher {
 public:
  Furnisher(Scene& scene, const Palette& palette, uint64_t seed)
      : scene_(scene), palette_(palette), random_(seed, "furniture") {}

  void desk(const std::string& name, const Frame& frame, const Eigen::Vector3f& size_m);
  void shelf_unit(const Frame& frame, const Eigen::Vector3f& size_m, int boards);
  void wall_shelf(const Frame& frame, float depth_m, float width_m);
  void chair(const Frame& frame);

  void monitor(const Frame& frame);
  void lamp(const Frame& frame);
  void plant(const Frame& frame, float height_m);
  void mug(const Frame& frame);
  void can(const Frame& frame);
  void carton(const Frame& frame, const Eigen::Vector3f& size_m);
  /// A card with a letter (0 is A), and the target "A" for it.
  void letter_card(const Frame& frame, size_t letter);
  void picture_box(const Frame& frame, const Eigen::Vector3f& size_m, int texture);
  /// Upright books side by side along y.
  void book_row(const Frame& frame, float width_m, float height_m);
  void book_stack(const Frame& frame, int count);
  /// A panel of 3×3 LEDs, and the scene's LedPanel for it, named "panel_1", "panel_2", …
  void led_panel(const Frame& frame, const std::bitset<9>& lit);
  /// A thin sheet that lies flat, its upper edge away from the viewer.
  void sheet(const std::string& name, const Frame& frame, float depth_m, float width_m,
             int texture);
  void keyboard(const Frame& frame);

 private:
  Finish stretched(int texture) const { return {texture, 0, 0, 0.02f}; }
  Finish tiled(int texture, float tile_m) const { return {texture, tile_m, 0, 0.02f}; }
  template <class T>
  T pick(const std::vector<T>& from) {
    return from[static_cast<size_t>(random_.below(static_cast<int>(from.size())))];
  }
  float vary(double low, double high) { return static_cast<float>(random_.uniform(low, high)); }

  Scene& scene_;
  const Palette& palette_;
  Random random_;
};

}  // namespace foresight::sim
