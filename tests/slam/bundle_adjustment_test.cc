#include "procs/slam/bundle_adjustment.h"

#include <gtest/gtest.h>

#include <random>

#include "procs/slam/geometry.h"

namespace foresight::slam {
namespace {

struct Truth {
  BundleProblem exact, disturbed;
};

// A row of cameras before a cloud; the first two are fixed, so that nothing floats.
Truth make_problem(double noise_px, int gross_every) {
  constexpr double kFocal = 500;
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::normal_distribution<double> normal;
  Truth t;
  for (int k = 0; k < 6; ++k) {
    const Pose<Map, Cam> pose(rotation_from_vector({0.02 * k, -0.03 * k, 0.01}),
                              {0.15 * k, 0.02 * k, 0.01 * k});
    t.exact.keyframes.push_back(
        {KeyframeId(k), k < 2 ? BundleRole::kFixed : BundleRole::kAdjusted, pose});
  }
  for (int i = 0; i < 120; ++i) {
    t.exact.points.push_back({PointId(i), {uniform(rng), uniform(rng), 3 + uniform(rng)}});
  }
  int count = 0;
  for (const BundleKeyframeIndex k : t.exact.keyframes.ids()) {
    for (const BundlePointIndex i : t.exact.points.ids()) {
      const Eigen::Vector3d p =
          t.exact.keyframes[k].map_from_cam.inverse() * t.exact.points[i].position_in_map;
      Eigen::Vector2d xy = p.head<2>() / p.z();
      xy += noise_px / kFocal * Eigen::Vector2d(normal(rng), normal(rng));
      if (gross_every > 0 && ++count % gross_every == 0) xy += Eigen::Vector2d(0.05, -0.04);
      t.exact.observations.push_back({k, i, xy, kFocal});
    }
  }
  t.disturbed = t.exact;
  for (BundleKeyframe& k : t.disturbed.keyframes) {
    if (k.role == BundleRole::kFixed) continue;
    Vector6d step;
    for (int i = 0; i < 6; ++i) step(i) = 0.02 * normal(rng);
    k.map_from_cam = small_motion<Map>(step) * k.map_from_cam;
  }
  for (BundlePoint& p : t.disturbed.points) {
    p.position_in_map += 0.05 * Eigen::Vector3d(normal(rng), normal(rng), normal(rng));
  }
  t.disturbed.max_iterations = 30;
  return t;
}

using BundlePoints = IdVector<BundlePointIndex, BundlePoint>;

double point_error(const BundlePoints& a, const BundlePoints& b) {
  double sum = 0;
  for (const BundlePointIndex i : a.ids()) {
    sum += (a[i].position_in_map - b[i].position_in_map).norm();
  }
  return sum / static_cast<double>(a.size());
}

TEST(BundleAdjustment, ReturnsToTheTruth) {
  const Truth t = make_problem(0, 0);
  const BundleSolution s = adjust_bundle(t.disturbed);
  ASSERT_TRUE(s.usable);
  EXPECT_LT(point_error(s.points, t.exact.points), 1e-3);
  EXPECT_LT(s.rms_px, 0.02);
  EXPECT_TRUE(s.outliers.empty());
  for (const BundleKeyframeIndex k :
       {BundleKeyframeIndex(0), BundleKeyframeIndex(1)}) {  // fixed means bitwise fixed
    EXPECT_EQ(s.keyframes[k].map_from_cam.matrix(), t.exact.keyframes[k].map_from_cam.matrix());
  }
}

TEST(BundleAdjustment, NamesGrossErrorsAndStillImproves) {
  const Truth t = make_problem(0.4, 37);
  const BundleSolution s = adjust_bundle(t.disturbed);
  ASSERT_TRUE(s.usable);
  EXPECT_LT(point_error(s.points, t.exact.points),
            0.3 * point_error(t.disturbed.points, t.exact.points));
  EXPECT_EQ(s.outliers.size(), t.exact.observations.size() / 37);
}

TEST(BundleAdjustment, SameProblemSameBytes) {
  const Truth t = make_problem(0.4, 37);
  const BundleSolution a = adjust_bundle(t.disturbed), b = adjust_bundle(t.disturbed);
  for (const BundlePointIndex i : a.points.ids()) {
    EXPECT_EQ(a.points[i].position_in_map, b.points[i].position_in_map);
  }
}

TEST(BundleAdjustment, AnEmptyProblemIsNotUsable) {
  EXPECT_FALSE(adjust_bundle(BundleProblem{}).usable);
}

}  // namespace
}  // namespace foresight::slam
