#include "procs/slam/pose_optimizer.h"

#include <gtest/gtest.h>

#include <random>

#include "procs/slam/geometry.h"

namespace foresight::slam {
namespace {

struct Scene {
  Pose<Map, Cam> truth;
  std::vector<PoseObservation> observations;
};

// `outliers` of the points are seen somewhere else, the rest with normal noise.
Scene make_scene(int points, int outliers, double noise_px) {
  constexpr double kFocal = 500;
  std::mt19937 rng(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::normal_distribution<double> normal(0, noise_px / kFocal);
  Scene scene;
  scene.truth = Pose<Map, Cam>(rotation_from_vector({0.3, -0.2, 0.1}), {0.5, -0.1, 0.3});
  for (int i = 0; i < points; ++i) {
    const Eigen::Vector3d p(uniform(rng), 0.7 * uniform(rng), 2.5 + uniform(rng));
    Eigen::Vector2d xy = p.head<2>() / p.z() + Eigen::Vector2d(normal(rng), normal(rng));
    if (i < outliers) xy += 0.15 * Eigen::Vector2d(uniform(rng), uniform(rng));
    scene.observations.push_back({scene.truth * p, xy, kFocal});
  }
  return scene;
}

Pose<Map, Cam> disturbed(const Pose<Map, Cam>& pose) {
  Vector6d step;
  step << 0.08, -0.05, 0.06, 0.03, -0.04, 0.05;
  return small_motion<Map>(step) * pose;
}

TEST(PoseOptimizer, FindsTheExactPose) {
  const Scene scene = make_scene(50, 0, 0);
  const PoseEstimate e = optimize_pose(disturbed(scene.truth), scene.observations);
  EXPECT_LT((e.map_from_cam.translation() - scene.truth.translation()).norm(), 1e-6);
  EXPECT_LT(e.map_from_cam.rotation().angularDistance(scene.truth.rotation()), 1e-6);
}

TEST(PoseOptimizer, IgnoresAThirdOfOutliers) {
  const Scene scene = make_scene(150, 50, 0.5);
  const PoseEstimate e = optimize_pose(disturbed(scene.truth), scene.observations);
  EXPECT_LT((e.map_from_cam.translation() - scene.truth.translation()).norm(), 2e-3);
  EXPECT_LT(e.map_from_cam.rotation().angularDistance(scene.truth.rotation()), 1e-3);
  int inliers = 0;
  for (size_t i = 50; i < 150; ++i) inliers += e.error_px[i] < 2.5;
  EXPECT_GE(inliers, 98);
}

TEST(PoseOptimizer, SaysWhenThePoseIsUndetermined) {
  Scene scene = make_scene(60, 0, 0);
  const double determined = optimize_pose(scene.truth, scene.observations).min_information;
  for (PoseObservation& o : scene.observations) o = scene.observations.front();
  const double undetermined = optimize_pose(scene.truth, scene.observations).min_information;
  EXPECT_LT(undetermined, 1e-6 * determined);
}

TEST(PoseOptimizer, PointsBehindTheCameraAreErrors) {
  Scene scene = make_scene(60, 0, 0);
  scene.observations[0].point_in_map = scene.truth * Eigen::Vector3d(0, 0, -2);
  const PoseEstimate e = optimize_pose(disturbed(scene.truth), scene.observations);
  EXPECT_GT(e.error_px[0], 100);
  EXPECT_LT((e.map_from_cam.translation() - scene.truth.translation()).norm(), 1e-6);
}

}  // namespace
}  // namespace foresight::slam
