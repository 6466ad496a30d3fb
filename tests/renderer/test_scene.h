// A textured room with a box in it, known twice: as a function that is ray cast, which gives true
// images for any camera, and as a mesh, which the renderer gets. Plus what the tests measure.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <string>

#include "procs/renderer/gl_context.h"
#include "procs/renderer/scene_renderer.h"

namespace foresight {

/// Room |x| < 3, |y| < 2, −2 < z < 5 and, where asked for, a red box in front of its far wall; all
/// times `scale`. Walls are green and blue with a smooth pattern, red stays below 90; the box has
/// red above 170.
struct TestScene {
  double scale = 1;
  bool with_box = true;

  Mesh mesh(int cells_per_side = 12) const;
  Image image(const CameraModel& camera, const Pose<Map, Cam>& map_from_cam) const;
  /// Depth along the optical axis of the first surface at a pixel.
  double depth(const CameraModel& camera, const Pose<Map, Cam>& map_from_cam,
               const Eigen::Vector2d& pixel) const;
  /// A camera at (x, y, z)·scale, turned right about y by `right_rad`; axes as the map's.
  Pose<Map, Cam> pose(double x, double y, double z, double right_rad = 0) const;
  TexturingView view(int64_t id, const CameraModel& camera, const Pose<Map, Cam>& pose) const;
};

CameraModel pinhole_camera();
CameraModel radtan_camera();
CameraModel fisheye_camera();

using Rgb = std::array<int, 3>;
Rgb pixel_at(const Image& image, int u, int v);
inline bool is_box_red(const Rgb& rgb) { return rgb[0] > 130; }

/// Peak signal-to-noise ratio in dB over the pixels that `use` accepts; 99 for equal pictures.
double psnr_db(
    const Image& a, const Image& b,
    const std::function<bool(int u, int v)>& use = [](int, int) { return true; });

/// Writes a PNG to look at into the test's temporary folder.
void save_picture(const Image& image, const std::string& name);
/// Source codes as colours: green newest, yellow and orange earlier, blue tint for guesses.
Image colour_sources(const RenderedFrame& frame);

/// Opens one off-screen context for all tests of a program.
class RendererTest : public testing::Test {
 protected:
  static void SetUpTestSuite();
  static GlContext& context();
};

}  // namespace foresight
