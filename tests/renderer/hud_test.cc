#include "procs/renderer/hud.h"

#include "procs/renderer/panels.h"
#include "procs/renderer/video_renderer.h"
#include "tests/renderer/test_scene.h"

namespace foresight {
namespace {

using HudTest = RendererTest;

TEST(PanelTest, NamesSharesOnlyOnceTheyAreCounted) {
  PredictionStatus status{.is_drawn = true, .triangles = 592};
  EXPECT_EQ(predicted_panel(status).lines.back(), "592 triangles");
  status.shares = SourceShares{.newest = 0.5, .earlier = 0.2, .guess = 0.25, .unknown = 0.05};
  EXPECT_EQ(predicted_panel(status).lines.back(), "70% measured, 25% guessed");
  status.shares = SourceShares{.unknown = 1};
  EXPECT_EQ(predicted_panel(status).lines.back(), "0% measured, 0% guessed");
}

TEST(LayoutTest, PicturesKeepTheirAspectAndStayInside) {
  for (const auto& [w, h] : {std::pair{1280, 480}, {640, 480}, {333, 777}, {1, 1}, {2000, 100}}) {
    for (const Layout layout : {Layout::kDelayed, Layout::kPredicted, Layout::kSideBySide,
                                Layout::kInset, Layout::kUndelayed}) {
      const Places places = place_pictures(layout, w, h, 4.0 / 3.0);
      EXPECT_EQ(places.delayed.has_value() && layout == Layout::kPredicted, false);
      for (const auto& place : {places.delayed, places.predicted, places.undelayed}) {
        if (!place) continue;
        EXPECT_GE(place->x_px, 0);
        EXPECT_GE(place->y_px, 0);
        EXPECT_LE(place->x_px + place->width_px, w);
        EXPECT_LE(place->y_px + place->height_px, h);
        EXPECT_NEAR(place->width_px, place->height_px * 4.0 / 3.0, 2.0);
      }
    }
  }
  const Places both = place_pictures(Layout::kSideBySide, 1280, 480, 4.0 / 3.0);
  EXPECT_EQ(both.delayed->width_px, 640);
  EXPECT_EQ(both.predicted->x_px, 640);
  const Places inset = place_pictures(Layout::kInset, 640, 480, 4.0 / 3.0);
  EXPECT_EQ(inset.predicted->width_px, 640);
  EXPECT_EQ(inset.delayed->x_px, 640 - 213);
  EXPECT_TRUE(place_pictures(Layout::kUndelayed, 640, 480, 4.0 / 3.0).undelayed);
  EXPECT_FALSE(place_pictures(Layout::kDelayed, 0, 480, 1).delayed);
}

TEST_F(HudTest, VideoIsUndistortedLikeTheScene) {
  const TestScene scene;
  const CameraModel camera = radtan_camera();
  const auto pose = scene.pose(0, 0, 0);
  VideoRenderer video;
  ASSERT_EQ(video.set_image(camera, scene.image(camera, pose)), InputStatus::kAccepted);
  ASSERT_EQ(video.draw(camera.undistorted()), RenderStatus::kDrawn);
  const Image seen = video.read_back().rgb;
  EXPECT_GT(psnr_db(seen, scene.image(camera.undistorted(), pose)), 30);

  SceneRenderer renderer;
  ASSERT_EQ(renderer.set_mesh(scene.mesh()), InputStatus::kAccepted);
  ASSERT_EQ(renderer.add_view(scene.view(1, camera, pose)), InputStatus::kAccepted);
  renderer.render(camera.undistorted(), pose);
  EXPECT_GT(psnr_db(seen, renderer.read_back().rgb), 45);
}

TEST_F(HudTest, BadVideoIsRejected) {
  VideoRenderer video;
  EXPECT_EQ(video.draw(pinhole_camera()), RenderStatus::kDrawn);  // nothing yet: drawn dark
  EXPECT_EQ(video.set_image(pinhole_camera(), Image{}), InputStatus::kBadImage);
  EXPECT_EQ(video.set_image(pinhole_camera(), Image{8, 8, 3, std::vector<uint8_t>(192)}),
            InputStatus::kBadImage);
  EXPECT_EQ(video.set_image(CameraModel{}, Image{}), InputStatus::kBadCamera);
  EXPECT_EQ(video.draw(radtan_camera()), RenderStatus::kBadCamera);
}

TEST_F(HudTest, SideBySideScreen) {
  const TestScene scene;
  const CameraModel camera = pinhole_camera();
  SceneRenderer renderer;
  VideoRenderer video;
  Hud hud;
  ASSERT_EQ(renderer.set_mesh(scene.mesh()), InputStatus::kAccepted);
  const TexturingView view = scene.view(1, camera, scene.pose(0, 0, 0));
  ASSERT_EQ(renderer.add_view(view), InputStatus::kAccepted);
  ASSERT_EQ(video.set_image(camera, view.image), InputStatus::kAccepted);
  renderer.render(camera, scene.pose(0.3, 0, 0));
  const Image predicted = renderer.read_back().rgb;
  video.draw(camera);

  const Places places = place_pictures(Layout::kSideBySide, 640, 240, 4.0 / 3.0);
  context().bind();
  hud.clear();
  hud.draw_texture(video.colour(), *places.delayed, 240);
  hud.draw_texture(renderer.colour(), *places.predicted, 240);
  const Image bare = context().read_rgb();
  EXPECT_EQ(pixel_at(bare, 10, 200), pixel_at(view.image, 10, 200));
  EXPECT_EQ(pixel_at(bare, 319, 0), pixel_at(view.image, 319, 0));
  EXPECT_EQ(pixel_at(bare, 320 + 10, 200), pixel_at(predicted, 10, 200));

  hud.draw_panel({Badge::kStale, "DELAYED", {"delay 300 ms", "30 fps"}}, *places.delayed, 240);
  hud.draw_panel({Badge::kOk, "PREDICTED", {"texture age 310 ms", "mesh 1728 triangles"}},
                 *places.predicted, 240);
  const Image screen = context().read_rgb();
  save_picture(screen, "screen");
  EXPECT_EQ(pixel_at(screen, 10, 200), pixel_at(bare, 10, 200));  // below the panel
  const Rgb badge = pixel_at(screen, 8 + 8, 8 + 9);
  EXPECT_NEAR(badge[0], 200, 2);
  EXPECT_NEAR(badge[1], 130, 2);
  context().present();
}

TEST_F(HudTest, OddTextDoesNoHarm) {
  Hud hud;
  context().bind();
  const Rectangle place{0, 0, 320, 240};
  hud.draw_panel({Badge::kNoModel, "", {}}, place, 240);
  hud.draw_panel({Badge::kLost, std::string(5000, 'x'), {"\xff\xfe\n", ""}}, place, 240);
  hud.draw_panel({Badge::kOk, "many", std::vector<std::string>(500, "line")}, place, 240);
  hud.draw_texture(0, place, 240);
  EXPECT_EQ(pixel_at(context().read_rgb(), 600, 200).size(), 3u);
}

}  // namespace
}  // namespace foresight
