// The stated uncertainty of a point against the spread of points triangulated from noisy rays.
#include "procs/slam/point_uncertainty.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "procs/slam/bundle_adjustment.h"

namespace foresight::slam {
namespace {

constexpr double kFocal_px = 400, kNoise_px = 0.4;
const Eigen::Vector3d kTruth(0.2, -0.1, 3);

// Cameras side by side, all looking along z.
Pose<Map, Cam> camera_at(int i, double apart) {
  return {Eigen::Quaterniond::Identity(), {apart * i, 0.02 * i, 0}};
}

SlamMap map_of(const Eigen::Vector3d& position, int views, double apart, std::mt19937* random) {
  std::normal_distribution<double> noise(0, kNoise_px / kFocal_px);
  SlamMap map;
  for (int i = 0; i < views; ++i) {
    Keyframe keyframe;
    keyframe.map_from_cam = camera_at(i, apart);
    map.add_keyframe(std::move(keyframe));
  }
  Corner source;
  source.keyframe_id = KeyframeId(0);
  const PointId id = map.add_point(position, source);
  for (int i = 0; i < views; ++i) {
    const Eigen::Vector3d p = camera_at(i, apart).inverse() * kTruth;
    const Eigen::Vector2d xy(p.x() / p.z() + noise(*random), p.y() / p.z() + noise(*random));
    map.add_observation(id, {KeyframeId(i), 0, {0, 0}, xy, kFocal_px});
  }
  return map;
}

Eigen::Vector3d triangulated(const SlamMap& map) {
  BundleProblem problem;
  for (const auto& [id, k] : map.keyframes()) {
    problem.keyframes.push_back({id, BundleRole::kFixed, k.map_from_cam});
  }
  const Point& point = *map.point(PointId(0));
  problem.points.push_back({PointId(0), point.position_in_map});
  for (const Observation& o : point.observations) {
    problem.observations.push_back(
        {BundleKeyframeIndex(o.keyframe_id.value()), BundlePointIndex(0), o.xy, o.scale_px()});
  }
  return adjust_bundle(problem).points.front().position_in_map;
}

void expect_calibrated(int views, double apart) {
  std::mt19937 random(7);
  double squares = 0, sigmas = 0;
  constexpr int kTrials = 400;
  for (int trial = 0; trial < kTrials; ++trial) {
    SlamMap map = map_of(kTruth, views, apart, &random);
    map.move_point(PointId(0), triangulated(map));
    const Point& point = *map.point(PointId(0));
    squares += std::pow(point.position_in_map.z() - kTruth.z(), 2);
    sigmas += position_sigma(map, point);
  }
  EXPECT_NEAR(sigmas / std::sqrt(squares * kTrials), 1, 0.15) << views << " views";
}

TEST(PointUncertainty, IsTheSpreadOfTriangulatedPoints) {
  expect_calibrated(3, 0.1);
  expect_calibrated(8, 0.1);
  expect_calibrated(3, 0.3);
}

TEST(PointUncertainty, IsTheDistanceWhereNothingIsKnown) {
  std::mt19937 random(7);
  const SlamMap map = map_of(kTruth, 3, 0, &random);
  EXPECT_LE(position_sigma(map, *map.point(PointId(0))), kTruth.norm());
  EXPECT_GT(position_sigma(map, *map.point(PointId(0))), 0.1);
}

}  // namespace
}  // namespace foresight::slam
