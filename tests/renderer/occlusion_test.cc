// What a texturing camera did not see must not be painted with what stood in its way.
#include "procs/renderer/scene_renderer.h"
#include "tests/renderer/test_scene.h"

namespace foresight {
namespace {

using OcclusionTest = RendererTest;

struct Comparison {
  RenderedFrame frame;
  Image truth;
  /// Pixels that truly show the wall but were painted red like the box.
  int ghosts = 0;
};

Comparison compare(SceneRenderer* renderer, const TestScene& scene, const Pose<Map, Cam>& pose) {
  const CameraModel camera = pinhole_camera();
  Comparison c;
  EXPECT_EQ(renderer->render(camera, pose).status, RenderStatus::kDrawn);
  c.frame = renderer->read_back();
  c.truth = scene.image(camera, pose);
  for (int v = 0; v < 240; ++v) {
    for (int u = 0; u < 320; ++u) {
      const bool ghost = is_box_red(pixel_at(c.frame.rgb, u, v)) && pixel_at(c.truth, u, v)[0] < 90;
      c.ghosts += ghost ? 1 : 0;
    }
  }
  return c;
}

TEST_F(OcclusionTest, HiddenWallIsUnknownNotRed) {
  const TestScene scene;
  const CameraModel camera = pinhole_camera();
  SceneRenderer renderer;
  ASSERT_EQ(renderer.set_mesh(scene.mesh()), InputStatus::kAccepted);
  ASSERT_EQ(renderer.add_view(scene.view(1, camera, scene.pose(0, 0, 0))), InputStatus::kAccepted);
  for (const double shift : {-1.0, -0.5, -0.2, 0.2, 0.5, 1.0}) {
    const Comparison c = compare(&renderer, scene, scene.pose(shift, 0, 0));
    save_picture(c.frame.rgb, "occlusion_" + std::to_string(shift));
    save_picture(colour_sources(c.frame), "occlusion_sources_" + std::to_string(shift));
    EXPECT_LT(c.ghosts, 60) << shift;  // the box's outline is 900 pixels long
    EXPECT_GT(count_sources(c.frame.source).unknown, 0.01) << shift;
  }
}

/// A pixel of the far wall that the first view cannot see behind the box, and the second can.
TEST_F(OcclusionTest, AnEarlierViewFillsTheHole) {
  const TestScene scene;
  const CameraModel camera = pinhole_camera();
  const auto predicted = scene.pose(0.8, 0, 0);
  const Eigen::Vector3d hidden(0.7, 0.2, 5);  // seen from (0, 0, 0) it lies behind the box
  const Eigen::Vector2d at = camera.project(predicted.inverse() * hidden);
  const auto [u, v] = std::pair(static_cast<int>(at.x() + 0.5), static_cast<int>(at.y() + 0.5));
  const size_t index = static_cast<size_t>(v) * 320 + u;
  SceneRenderer renderer;
  ASSERT_EQ(renderer.set_mesh(scene.mesh()), InputStatus::kAccepted);
  ASSERT_EQ(renderer.add_view(scene.view(5, camera, scene.pose(0, 0, 0))), InputStatus::kAccepted);
  const Comparison before = compare(&renderer, scene, predicted);
  EXPECT_EQ(before.frame.source[index], kSourceUnknown);
  EXPECT_LT(pixel_at(before.frame.rgb, u, v)[0], 90);

  ASSERT_EQ(renderer.add_view(scene.view(1, camera, scene.pose(1.2, 0.3, 0))),
            InputStatus::kAccepted);  // older by its time
  const Comparison after = compare(&renderer, scene, predicted);
  save_picture(after.frame.rgb, "filled");
  save_picture(colour_sources(after.frame), "filled_sources");
  EXPECT_EQ(after.frame.source[index], kSourceNewest + 1);
  const Rgb painted = pixel_at(after.frame.rgb, u, v), truth = pixel_at(after.truth, u, v);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(painted[c], truth[c], 8);
  EXPECT_LT(count_sources(after.frame.source).unknown, count_sources(before.frame.source).unknown);
  EXPECT_LT(after.ghosts, 60);
}

/// Surfaces must not shadow themselves: a room without a box has nothing hidden in it.
TEST_F(OcclusionTest, NoSurfaceHidesItself) {
  TestScene scene;
  scene.with_box = false;
  const CameraModel camera = pinhole_camera();
  for (const int cells : {1, 7, 60}) {
    SceneRenderer renderer;
    ASSERT_EQ(renderer.set_mesh(scene.mesh(cells)), InputStatus::kAccepted);
    ASSERT_EQ(renderer.add_view(scene.view(1, camera, scene.pose(0.2, 0, -1.5, 0.03))),
              InputStatus::kAccepted);
    const Comparison c = compare(&renderer, scene, scene.pose(0.0, 0.15, -0.5));
    save_picture(c.frame.rgb, "self_shadow_" + std::to_string(cells));
    EXPECT_EQ(count_sources(c.frame.source).unknown, 0) << cells;
  }
}

/// A surface that the newest view sees at a grazing angle is better painted by a view that faces
/// it.
TEST_F(OcclusionTest, AGrazingNewestViewGivesWayToAFacingOne) {
  TestScene scene;
  scene.with_box = false;
  const CameraModel camera = pinhole_camera();
  SceneRenderer renderer;
  ASSERT_EQ(renderer.set_mesh(scene.mesh()), InputStatus::kAccepted);
  ASSERT_EQ(renderer.add_view(scene.view(2, camera, scene.pose(2.9, 0, -1))),
            InputStatus::kAccepted);  // skims along the right wall
  ASSERT_EQ(renderer.add_view(scene.view(1, camera, scene.pose(-1, 0, 3, 1.2))),
            InputStatus::kAccepted);
  const auto predicted = scene.pose(0, 0, 3.2, 1.5708);  // faces the right wall
  const Comparison c = compare(&renderer, scene, predicted);
  EXPECT_EQ(c.frame.source[120 * 320 + 160], kSourceNewest + 1);
  const auto painted = [&c](int u, int v) {
    return source_rank(c.frame.source[static_cast<size_t>(v) * 320 + u]) == 1;
  };
  EXPECT_GT(psnr_db(c.frame.rgb, c.truth, painted), 28);
}

}  // namespace
}  // namespace foresight
