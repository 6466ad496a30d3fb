// What the operator sees around the pictures: the layout, and a status panel.
//
//   Hud hud;                                               // needs a current GlContext
//   const auto places = place_pictures(Layout::kSideBySide, 1280, 480, 4.0 / 3.0);
//   video.draw(camera.undistorted());                      // VideoRenderer, same lens shader
//   context.bind();
//   hud.clear();
//   hud.draw_texture(video.colour(), *places.delayed, context.height_px());
//   hud.draw_texture(scene.colour(), *places.predicted, context.height_px());
//   hud.draw_panel({Badge::kOk, "PREDICTED", {"delay 300 ms", "30 fps"}}, *places.predicted,
//                  context.height_px());
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace foresight {

/// Pixels of the shown framebuffer, from its top-left corner.
struct Rectangle {
  int x_px = 0, y_px = 0, width_px = 0, height_px = 0;
};

enum class Layout {
  kDelayed,     // the delayed video alone
  kPredicted,   // the predicted view alone
  kSideBySide,  // delayed left, predicted right
  kInset,       // the predicted view, the delayed video small in its corner
  kUndelayed,   // the video as the robot sees it now: for comparison where there is no link
};

struct Places {
  std::optional<Rectangle> delayed;  // drawn after predicted
  std::optional<Rectangle> predicted;
  std::optional<Rectangle> undelayed;
};

/// Largest rectangles of the given aspect (width / height), centred in their share of the window.
/// None when there is no room.
Places place_pictures(Layout layout, int window_width_px, int window_height_px, double aspect);

enum class Badge { kOk, kStale, kLost, kNoModel };

struct Panel {
  Badge badge = Badge::kOk;
  std::string title;               // printable ASCII
  std::vector<std::string> lines;  // e.g. "delay 300 ms"
};

class Hud {
 public:
  Hud();  // throws GlError
  ~Hud();
  /// Fills the bound framebuffer with the window's background.
  void clear();
  /// Scales a texture (first row on top at t = 0) into a rectangle of the bound framebuffer.
  void draw_texture(unsigned texture, const Rectangle& place, int window_height_px);
  /// Badge, title and lines in the top-left corner of a rectangle. Text is redrawn only on change.
  void draw_panel(const Panel& panel, const Rectangle& place, int window_height_px);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace foresight
