#include "sim/ray_camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "sim/random.h"
#include "sim/sequence.h"

namespace foresight::sim {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kSquares = 10;
constexpr double kSquare_m = 0.1;

cv::Mat checkers(int squares, int square_px) {
  cv::Mat image(squares * square_px, squares * square_px, CV_8UC3);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const uint8_t level = (x / square_px + y / square_px) % 2 == 0 ? 230 : 30;
      image.at<cv::Vec3b>(y, x) = {level, level, level};
    }
  }
  return image;
}

// A square board that fills x and y in ±size/2 at z = 0, seen from negative z with y down.
Scene board(const cv::Mat& paint, float size_m) {
  Scene scene;
  const int texture = scene.add_texture(make_texture(paint, false));
  const float h = size_m / 2;
  add_quad(scene, "board", {{{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}}},
           {.texture = texture, .glow = 1});
  return scene;
}

Scene checkered_board() {
  return board(checkers(kSquares, 64), static_cast<float>(kSquares * kSquare_m));
}

Pose<World, Cam> facing(double distance_m, const Vector3d& turn_rad = Vector3d::Zero()) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(
      turn_rad.norm(), turn_rad.norm() > 0 ? turn_rad.normalized() : Vector3d::UnitX()));
  return {turn, turn * Vector3d(0, 0, -distance_m)};
}

cv::Mat gray(const Image& image) {
  cv::Mat rgb(image.height_px, image.width_px, CV_8UC3), out;
  std::copy(image.bytes.begin(), image.bytes.end(), rgb.data);
  cv::cvtColor(rgb, out, cv::COLOR_RGB2GRAY);
  return out;
}

TEST(RayCamera, CornersAppearWhereTheModelProjectsThem) {
  const Scene scene = checkered_board();
  for (const bool distorted : {false, true}) {
    for (const Vector3d& turn : {Vector3d(0, 0, 0), Vector3d(0.3, -0.2, 0.4)}) {
      RayCamera camera(scene, {.model = sequence_camera(640, distorted)});
      const Pose<World, Cam> world_from_cam = facing(1.1, turn);
      const cv::Mat image = gray(camera.render(world_from_cam, 0));
      Eigen::Vector2d sum_px = Eigen::Vector2d::Zero();
      double worst_px = 0;
      int seen = 0;
      for (int i = 1; i < kSquares; ++i) {
        for (int j = 1; j < kSquares; ++j) {
          const Vector3d corner((i - kSquares / 2.0) * kSquare_m, (j - kSquares / 2.0) * kSquare_m,
                                0);
          const Eigen::Vector2d expected =
              camera.model().project(world_from_cam.inverse() * corner);
          if (!camera.model().in_image(expected, 15)) continue;
          std::vector<cv::Point2f> found = {cv::Point2f(cv::Point2d(expected.x(), expected.y()))};
          cv::cornerSubPix(image, found, {6, 6}, {-1, -1},
                           {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 1e-3});
          const Eigen::Vector2d off_px = Eigen::Vector2d(found[0].x, found[0].y) - expected;
          worst_px = std::max(worst_px, off_px.norm());
          sum_px += off_px;
          ++seen;
        }
      }
      EXPECT_GE(seen, 40);
      // The corner finder itself is off by a tenth of a pixel; the mean shows what the camera adds.
      EXPECT_LT(worst_px, 0.25) << (distorted ? "distorted" : "pinhole");
      EXPECT_LT(sum_px.norm() / seen, 0.02) << (distorted ? "distorted" : "pinhole");
    }
  }
}

TEST(RayCamera, DepthIsTheDistanceToThePlane) {
  const Scene scene = board(cv::Mat(64, 64, CV_8UC3, cv::Scalar(128, 128, 128)), 20);
  for (const bool distorted : {false, true}) {
    const RayCamera camera(scene, {.model = sequence_camera(320, distorted)});
    const Pose<World, Cam> world_from_cam = facing(2.0, {0.4, 0.3, -0.5});
    const DepthImage depth = camera.render_depth(world_from_cam);
    ASSERT_EQ(depth.depth_m.size(), 320u * 240u);
    for (int y = 0; y < 240; ++y) {
      for (int x = 0; x < 320; ++x) {
        const Eigen::Vector2d ray = camera.model().unproject({x, y});
        const Vector3d direction = world_from_cam.rotation() * ray.homogeneous();
        const double expected_m = -world_from_cam.translation().z() / direction.z();
        ASSERT_NEAR(depth.depth_m[y * 320 + x], expected_m, 1e-4) << x << "," << y;
      }
    }
  }
}

TEST(RayCamera, SeesNothingBesideTheScene) {
  const Scene scene = board(checkers(2, 8), 0.1f);
  RayCamera camera(scene, {.model = sequence_camera(160, false)});
  const DepthImage depth = camera.render_depth(facing(1));
  EXPECT_EQ(depth.depth_m.front(), 0);
  EXPECT_NEAR(depth.depth_m[60 * 160 + 80], 1, 1e-5);
  EXPECT_EQ(camera.render(facing(1), 0).bytes.front(), 0);
}

TEST(RayCamera, RepeatsItselfExactly) {
  const Scene scene = checkered_board();
  const RayCameraParams params{.model = sequence_camera(320, true), .noise_levels = 3};
  RayCamera camera(scene, params), other(scene, params);
  const Image first = camera.render(facing(1.2, {0.1, 0.2, 0}), 5);
  camera.render(facing(2), 6);
  EXPECT_EQ(first.bytes, camera.render(facing(1.2, {0.1, 0.2, 0}), 5).bytes);
  EXPECT_EQ(first.bytes, other.render(facing(1.2, {0.1, 0.2, 0}), 5).bytes);
  EXPECT_NE(first.bytes, camera.render(facing(1.2, {0.1, 0.2, 0}), 7).bytes);
}

TEST(RayCamera, FarTexturesDoNotAlias) {
  const Scene scene = board(checkers(256, 4), 2);  // 8 mm squares
  RayCamera camera(scene, {.model = sequence_camera(320, false), .vignetting = 0});
  cv::Scalar mean, deviation;
  // At 6 m a pixel covers three squares.
  const cv::Mat image = gray(camera.render(facing(6), 0));
  cv::meanStdDev(image(cv::Rect(130, 90, 60, 60)), mean, deviation);
  EXPECT_NEAR(mean[0], 130, 4);
  EXPECT_LT(deviation[0], 3);
}

TEST(RayCamera, SoftensEdges) {
  const Scene scene = board(cv::Mat(8, 8, CV_8UC3, cv::Scalar(200, 200, 200)), 0.8f);
  const auto shades_between = [&scene](Antialiasing antialiasing) {
    RayCamera camera(scene, {.model = sequence_camera(320, false), .antialiasing = antialiasing});
    const cv::Mat image = gray(camera.render(facing(1.5, {0, 0, 0.3}), 0));
    return cv::countNonZero((image > 20) & (image < 150));
  };
  EXPECT_EQ(shades_between(Antialiasing::kNone), 0);
  EXPECT_GT(shades_between(Antialiasing::kEdges), 100);
  EXPECT_EQ(shades_between(Antialiasing::kEdges), shades_between(Antialiasing::kFull));
}

TEST(RayCamera, ExposureVignettingAndNoiseAreAsAsked) {
  const Scene scene = board(cv::Mat(64, 64, CV_8UC3, cv::Scalar(100, 100, 100)), 20);
  RayCameraParams params{.model = sequence_camera(320, false), .vignetting = 0};
  EXPECT_EQ(cv::mean(gray(RayCamera(scene, params).render(facing(1), 0)))[0], 100);
  params.exposure = 2;
  EXPECT_NEAR(cv::mean(gray(RayCamera(scene, params).render(facing(1), 0)))[0],
              100 * std::pow(2, 1 / 2.2), 1);
  params.exposure = 1;
  params.vignetting = 0.5;
  const cv::Mat dark_corners = gray(RayCamera(scene, params).render(facing(1), 0));
  EXPECT_EQ(dark_corners.at<uint8_t>(120, 160), 100);
  EXPECT_NEAR(dark_corners.at<uint8_t>(0, 0), 100 * std::pow(0.5, 1 / 2.2), 1.5);
  params.vignetting = 0;
  params.noise_levels = 4;
  cv::Mat red, noisy(240, 320, CV_8UC3);
  const Image image = RayCamera(scene, params).render(facing(1), 0);
  std::copy(image.bytes.begin(), image.bytes.end(), noisy.data);
  cv::extractChannel(noisy, red, 0);
  cv::Scalar mean, deviation;
  cv::meanStdDev(red, mean, deviation);
  EXPECT_NEAR(mean[0], 100, 0.3);
  EXPECT_NEAR(deviation[0], 4, 0.3);
}

TEST(RayCamera, ExposureAndGlowChangeWhileItRuns) {
  Scene scene = board(cv::Mat(64, 64, CV_8UC3, cv::Scalar(100, 100, 100)), 20);
  const uint32_t half = pack_texel(127.5f / kLightMapRange, 127.5f / kLightMapRange, 0);
  scene.surfaces[0].light = {1, 1, {half}};
  RayCamera camera(scene, {.model = sequence_camera(160, false), .vignetting = 0});
  const auto level = [](RayCamera& c) { return cv::mean(gray(c.render(facing(1), 0)))[0]; };
  EXPECT_EQ(level(camera), 100);
  camera.set_exposure(2);
  EXPECT_NEAR(level(camera), 100 * std::pow(2, 1 / 2.2), 1);
  camera.set_exposure(1);
  camera.set_glow(0, 2.5f);
  EXPECT_NEAR(level(camera), 250, 1e-6);
  camera.set_glow(0, 0);  // back to the baked light, which is yellow
  const Image image = camera.render(facing(1), 0);
  EXPECT_NEAR(image.bytes[0], 50, 1);
  EXPECT_EQ(image.bytes[2], 0);
  RayCamera other(scene, {.model = sequence_camera(160, false), .vignetting = 0});
  EXPECT_EQ(level(other), 100);
}

TEST(RayCamera, AnOpenShutterBlursAlongTheMotion) {
  const Scene scene = checkered_board();
  RayCamera camera(scene, {.model = sequence_camera(320, false), .vignetting = 0});
  std::vector<Pose<World, Cam>> sliding;
  for (int i = 0; i < 4; ++i) {
    sliding.push_back({Eigen::Quaterniond::Identity(), Vector3d(0.01 * (i - 1.5), 0, -1)});
  }
  cv::Mat across, down;
  const cv::Mat image = gray(camera.render(sliding, 0));
  cv::Sobel(image, across, CV_32F, 1, 0);
  cv::Sobel(image, down, CV_32F, 0, 1);
  EXPECT_LT(cv::norm(across, cv::NORM_INF), 0.75 * cv::norm(down, cv::NORM_INF));
  // Light is averaged, not levels: half white and half black is brighter than the middle.
  EXPECT_GT(cv::mean(image)[0], cv::mean(gray(camera.render(sliding[0], 0)))[0] + 3);
}

TEST(RayCamera, WorksAtAnySize) {
  const Scene scene = checkered_board();
  for (const int width : {1, 3, 17, 130}) {
    CameraModel model = sequence_camera(640, false);
    model.width_px = width;
    model.height_px = width + 2;
    RayCamera camera(scene, {.model = model, .noise_levels = 1});
    EXPECT_TRUE(camera.render(facing(1), 0).is_valid());
    EXPECT_EQ(camera.render_depth(facing(1)).depth_m.size(),
              static_cast<size_t>(width) * (width + 2));
  }
}

}  // namespace
}  // namespace foresight::sim
