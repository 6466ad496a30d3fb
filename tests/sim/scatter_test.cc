#include "sim/scatter.h"

#include <gtest/gtest.h>

#include "sim/sequence.h"

namespace foresight::sim {
namespace {

constexpr ScatterParams kWide = {.distance_m = 0.3, .turn_rad = 0.35};

// A wall across x, and a camera that looks at it from a distance.
Scene wall() {
  Scene scene;
  add_quad(scene, "wall", {{{0, 9, 9}, {0, -9, 9}, {0, -9, -9}, {0, 9, -9}}}, {});
  return scene;
}
Pose<World, Cam> before_wall(double distance_m) {
  Eigen::Matrix3d world_from_cam;  // columns: right, down, forward
  world_from_cam << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {world_from_cam, Eigen::Vector3d(-distance_m, 0, 0)};
}

double turn_of(const Pose<Cam, Cam>& shift) {
  return shift.rotation().angularDistance(Eigen::Quaterniond::Identity());
}

TEST(Scatter, FillsTheBallAndNoMore) {
  const Scatter scatter(wall(), sequence_camera(640, false), kWide);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  int outer = 0;
  double most_turn = 0;
  constexpr int kCount = 2000;
  for (uint64_t seed = 0; seed < kCount; ++seed) {
    const Pose<Cam, Cam> shift = scatter.shift(before_wall(3), seed);
    ASSERT_LE(shift.translation().norm(), kWide.distance_m);
    ASSERT_LE(turn_of(shift), kWide.turn_rad + 1e-9);
    mean += shift.translation() / kCount;
    outer += shift.translation().norm() > kWide.distance_m / std::cbrt(2.0);
    most_turn = std::max(most_turn, turn_of(shift));
  }
  EXPECT_LT(mean.norm(), 0.02);
  EXPECT_NEAR(outer, kCount / 2, 100);  // uniform: half of the ball's volume is outside that radius
  EXPECT_GT(most_turn, 0.95 * kWide.turn_rad);
}

TEST(Scatter, DependsOnTheSeedAlone) {
  const Scene scene = wall();
  const Scatter one(scene, sequence_camera(640, false), kWide);
  const Scatter again(scene, sequence_camera(640, false), kWide);
  const Pose<World, Cam> pose = before_wall(3);
  EXPECT_EQ(one.shift(pose, 7).matrix(), again.shift(pose, 7).matrix());
  EXPECT_NE(one.shift(pose, 7).matrix(), one.shift(pose, 8).matrix());
}

TEST(Scatter, StaysBeforeThings) {
  const Scatter scatter(wall(), sequence_camera(640, false), kWide);
  const Pose<World, Cam> pose = before_wall(0.4);
  int moved = 0;
  for (uint64_t seed = 0; seed < 500; ++seed) {
    const Pose<World, Cam> world_from_moved = pose * scatter.shift(pose, seed);
    ASSERT_LT(world_from_moved.translation().x(), -0.22);  // oblique views may come a little nearer
    moved += world_from_moved.translation() != pose.translation();
  }
  EXPECT_GT(moved, 490);
}

TEST(Scatter, DoesNotPassThroughThings) {
  // A camera that looks away from a wall close behind it sees nothing near, wherever it is.
  const Scatter scatter(wall(), sequence_camera(640, false), {.distance_m = 0.3});
  const Eigen::Quaterniond half_turn(Eigen::AngleAxisd(3.14159265, Eigen::Vector3d::UnitY()));
  const Pose<World, Cam> away = before_wall(0.1) * Pose<Cam, Cam>(half_turn, {0, 0, 0});
  for (uint64_t seed = 0; seed < 500; ++seed) {
    ASSERT_LT((away * scatter.shift(away, seed)).translation().x(), 0);
  }
}

TEST(Scatter, GivesUpWhereNoPlaceIsFree) {
  const Scatter scatter(wall(), sequence_camera(640, false), {.distance_m = 0.05, .turn_rad = 0.1});
  for (uint64_t seed = 0; seed < 20; ++seed) {
    EXPECT_EQ(scatter.shift(before_wall(0.1), seed).matrix(), Eigen::Matrix4d::Identity());
  }
}

}  // namespace
}  // namespace foresight::sim
