#include "common/camera_model.h"

#include <gtest/gtest.h>

#include <random>

#include "common/messages.h"

namespace foresight {
namespace {

CameraModel make_camera(LensModel lens, const std::array<double, 5>& distortion) {
  CameraModel camera;
  camera.lens = lens;
  camera.width_px = 640;
  camera.height_px = 480;
  camera.fx_px = 517.3;
  camera.fy_px = 516.5;
  camera.cx_px = 318.6;
  camera.cy_px = 255.3;
  camera.distortion = distortion;
  camera.prepare();
  return camera;
}

const CameraModel kPinhole = make_camera(LensModel::kRadtan, {});
// TUM freiburg1: strong, and not monotonic far outside the image.
const CameraModel kFr1 =
    make_camera(LensModel::kRadtan, {0.262383, -0.953104, -0.005358, 0.002628, 1.163314});
const CameraModel kFisheye = make_camera(LensModel::kEquidistant, {-0.03, 0.01, -0.004, 0.0005, 0});

class EveryCamera : public testing::TestWithParam<const CameraModel*> {};
INSTANTIATE_TEST_SUITE_P(Models, EveryCamera, testing::Values(&kPinhole, &kFr1, &kFisheye));

TEST_P(EveryCamera, ProjectsWhatItUnprojectsToTheSamePixel) {
  const CameraModel& camera = *GetParam();
  double worst_px = 0;
  for (int y = 0; y < camera.height_px; y += 3) {
    for (int x = 0; x < camera.width_px; x += 3) {
      const Eigen::Vector2d pixel(x, y);
      const Eigen::Vector2d xy = camera.unproject(pixel);
      worst_px = std::max(worst_px, (camera.project_normalized(xy) - pixel).norm());
    }
  }
  EXPECT_LT(worst_px, 1e-6);
}

TEST_P(EveryCamera, UnprojectsWhatItProjectsToTheSameRay) {
  const CameraModel& camera = *GetParam();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> x(-0.55, 0.55), y(-0.42, 0.42), z(0.1, 20);
  for (int i = 0; i < 10'000; ++i) {
    const Eigen::Vector2d xy(x(random), y(random));
    const double depth = z(random);
    const Eigen::Vector2d pixel = camera.project({xy.x() * depth, xy.y() * depth, depth});
    EXPECT_LT((camera.unproject(pixel) - xy).norm(), 1e-8) << pixel.transpose();
  }
}

TEST_P(EveryCamera, ItsJacobianIsTheDifferenceQuotient) {
  const CameraModel& camera = *GetParam();
  std::mt19937 random(4);
  std::uniform_real_distribution<double> x(-0.5, 0.5), y(-0.4, 0.4);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector2d xy(x(random), y(random));
    Eigen::Matrix2d jacobian, numeric;
    camera.project_normalized(xy, &jacobian);
    for (int k = 0; k < 2; ++k) {
      const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(k);
      numeric.col(k) =
          (camera.project_normalized(xy + step) - camera.project_normalized(xy - step)) /
          (2 * kStep);
    }
    EXPECT_LT((jacobian - numeric).norm(), 1e-4 * jacobian.norm()) << xy.transpose();
  }
}

TEST_P(EveryCamera, ScalesConsistently) {
  const CameraModel& camera = *GetParam();
  const CameraModel half = camera.scaled(0.5);
  EXPECT_EQ(half.width_px, 320);
  EXPECT_EQ(half.height_px, 240);
  const Eigen::Vector3d point(0.2, -0.1, 1.0);
  const Eigen::Vector2d corner(0.5, 0.5);  // the image's corner lies half a pixel before (0, 0)
  EXPECT_LT(((camera.project(point) + corner) / 2 - (half.project(point) + corner)).norm(), 1e-9);
}

TEST_P(EveryCamera, SurvivesItsMessage) {
  EXPECT_EQ(from_message(to_message(*GetParam(), Time{5})), *GetParam());
}

TEST(CameraModel, AgreesWithThePinholeFormula) {
  const Eigen::Vector2d pixel = kPinhole.project({0.5, -0.25, 2});
  EXPECT_DOUBLE_EQ(pixel.x(), 318.6 + 517.3 * 0.25);
  EXPECT_DOUBLE_EQ(pixel.y(), 255.3 - 516.5 * 0.125);
}

// OpenCV's formula, evaluated by hand for one ray.
TEST(CameraModel, AgreesWithOpenCvsRadtanFormula) {
  const double x = 0.3, y = -0.2, r2 = x * x + y * y;
  const double radial = 1 + 0.262383 * r2 - 0.953104 * r2 * r2 + 1.163314 * r2 * r2 * r2;
  const double p1 = -0.005358, p2 = 0.002628;
  const double u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
  const double v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
  const Eigen::Vector2d pixel = kFr1.project({x, y, 1});
  EXPECT_NEAR(pixel.x(), 517.3 * u + 318.6, 1e-9);
  EXPECT_NEAR(pixel.y(), 516.5 * v + 255.3, 1e-9);
}

TEST(CameraModel, TheFisheyeMeasuresAnglesNotTangents) {
  const CameraModel camera = make_camera(LensModel::kEquidistant, {});
  const double angle = 1.2;  // 69° off the axis
  const Eigen::Vector2d pixel = camera.project({std::tan(angle), 0, 1});
  EXPECT_NEAR(pixel.x(), 318.6 + 517.3 * angle, 1e-9);
}

TEST(CameraModel, UndistortedKeepsSizeAndMatrix) {
  const CameraModel plain = kFr1.undistorted();
  EXPECT_FALSE(plain.has_distortion());
  EXPECT_EQ(plain.fx_px, kFr1.fx_px);
  EXPECT_EQ(plain.width_px, kFr1.width_px);
  EXPECT_TRUE(kFr1.has_distortion());
}

// Beyond max_radius the polynomial folds back: such a ray must be recognisable as outside.
TEST(CameraModel, KnowsWhereItsDistortionStopsBeingInvertible) {
  const CameraModel folding = make_camera(LensModel::kRadtan, {-0.4, 0, 0, 0, 0});
  EXPECT_NEAR(folding.max_radius, std::sqrt(1 / 1.2), 0.02);  // d/dr (r − 0.4 r³) = 0
  EXPECT_GT(kPinhole.max_radius, 5);
}

TEST(CameraModel, InImageHasAMargin) {
  EXPECT_TRUE(kPinhole.in_image({0, 0}));
  EXPECT_TRUE(kPinhole.in_image({639, 479}));
  EXPECT_FALSE(kPinhole.in_image({639.1, 0}));
  EXPECT_FALSE(kPinhole.in_image({4, 100}, 5));
}

}  // namespace
}  // namespace foresight
