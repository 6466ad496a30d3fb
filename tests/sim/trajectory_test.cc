#include "sim/trajectory.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <set>

#include "sim/lab.h"

namespace foresight::sim {
namespace {

using Kind = Trajectory::Kind;
constexpr Kind kAtDesk[] = {Kind::kDesk, Kind::kRotation, Kind::kStatic, Kind::kReturn,
                            Kind::kWander};
constexpr Kind kAll[] = {Kind::kDesk,   Kind::kRotation, Kind::kStatic,
                         Kind::kReturn, Kind::kLoop,     Kind::kWander};
constexpr Duration kStep = milliseconds(10);

TEST(Trajectory, StaysWithinTheSpeedLimits) {
  for (const Kind kind : kAll) {
    for (uint64_t seed = 0; seed < 20; ++seed) {
      const Trajectory trajectory(kind, seed);
      Pose<World, Cam> last = trajectory.at({});
      for (Duration t = kStep; t < seconds(60); t = t + kStep) {
        const Pose<World, Cam> now = trajectory.at(t);
        const double moved_m = (now.translation() - last.translation()).norm();
        const double turned_rad = now.rotation().angularDistance(last.rotation());
        ASSERT_LE(moved_m / kStep.seconds(), kMaxSpeed_m_per_s) << seed << " at " << t.seconds();
        ASSERT_LE(turned_rad / kStep.seconds(), kMaxTurn_rad_per_s) << seed;
        last = now;
      }
    }
  }
}

TEST(Trajectory, StaysInTheFreeSpaceBeforeTheDesk) {
  for (const Kind kind : kAtDesk) {
    for (uint64_t seed = 0; seed < 20; ++seed) {
      const Trajectory trajectory(kind, seed);
      for (Duration t; t < seconds(60); t = t + milliseconds(100)) {
        const Pose<World, Cam> world_from_cam = trajectory.at(t);
        const Eigen::Vector3d at = world_from_cam.translation();
        ASSERT_LT(at.x(), 0.65);  // the desk's edge is at 0.75 m
        ASSERT_LT(at.head<2>().norm(), 1.0);
        ASSERT_GT(at.z(), kDeskTop_m + 0.3);
        // Looks at the desk's side of the room, upright.
        ASSERT_GT((world_from_cam.rotation() * Eigen::Vector3d::UnitZ()).x(), 0.5);
        ASSERT_LT((world_from_cam.rotation() * Eigen::Vector3d::UnitY()).z(), -0.7);
      }
    }
  }
}

TEST(Trajectory, StartsFromRestAndMovesSideways) {
  for (uint64_t seed = 0; seed < 10; ++seed) {
    const Trajectory trajectory(Kind::kDesk, seed);
    const Pose<Cam, World> cam_from_world = trajectory.at({}).inverse();
    const Eigen::Vector3d soon = cam_from_world * trajectory.at(milliseconds(100)).translation();
    EXPECT_LT(soon.norm(), 1e-3);
    const Eigen::Vector3d later = cam_from_world * trajectory.at(seconds(2.5)).translation();
    EXPECT_GT(std::abs(later.x()), 0.15);  // a baseline to start a map on
    EXPECT_GT(std::abs(later.x()), 2 * std::abs(later.z()));
  }
}

TEST(Trajectory, KindsDoWhatTheySay) {
  const Trajectory still(Kind::kStatic, 3), turning(Kind::kRotation, 3),
      returning(Kind::kReturn, 3);
  double turned_rad = 0, away_m = 0;
  for (Duration t; t < seconds(10); t = t + milliseconds(50)) {
    EXPECT_EQ(still.at(t).matrix(), still.at({}).matrix());
    EXPECT_EQ(turning.at(t).translation(), turning.at({}).translation());
    turned_rad =
        std::max(turned_rad, turning.at(t).rotation().angularDistance(turning.at({}).rotation()));
    away_m =
        std::max(away_m, (returning.at(t).translation() - returning.at({}).translation()).norm());
  }
  EXPECT_GT(turned_rad, 0.4);
  EXPECT_GT(away_m, 0.3);
  for (const int count : {1, 2, 3}) {
    const Pose<World, Cam> back = returning.at(returning.time_of_return(count));
    EXPECT_LT((back.translation() - returning.at({}).translation()).norm(), 1e-6);
    EXPECT_LT(back.rotation().angularDistance(returning.at({}).rotation()), 1e-6);
  }
}

TEST(Trajectory, AWanderingHandIsNeverWhereItWas) {
  for (uint64_t seed = 0; seed < 5; ++seed) {
    const Trajectory trajectory(Kind::kWander, seed);
    const Pose<World, Cam> early = trajectory.at(seconds(10));
    double nearest = 1e9, farthest_m = 0, turned_rad = 0;
    for (Duration t = seconds(15); t < seconds(600); t = t + milliseconds(50)) {
      const Pose<World, Cam> now = trajectory.at(t);
      const double moved_m = (now.translation() - early.translation()).norm();
      const double rotated_rad = now.rotation().angularDistance(early.rotation());
      nearest = std::min(nearest, std::hypot(moved_m, rotated_rad));
      farthest_m = std::max(farthest_m, moved_m);
      turned_rad = std::max(turned_rad, rotated_rad);
    }
    EXPECT_GT(nearest, 0.01);  // the next keyframe is 0.035 depths away
    EXPECT_GT(farthest_m, 0.25);
    EXPECT_GT(turned_rad, 0.35);
  }
}

TEST(Trajectory, LoopLooksOutwardFromARing) {
  constexpr double kDegree = std::numbers::pi / 180;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const Trajectory trajectory(Kind::kLoop, seed);
    EXPECT_LT(
        (trajectory.at(milliseconds(100)).translation() - trajectory.at({}).translation()).norm(),
        1e-3);
    double least_m = 9, greatest_m = 0;
    for (Duration t; t < seconds(40); t = t + milliseconds(100)) {
      const Pose<World, Cam> world_from_cam = trajectory.at(t);
      const Eigen::Vector3d at = world_from_cam.translation();
      const Eigen::Vector3d forward = world_from_cam.rotation() * Eigen::Vector3d::UnitZ();
      const double radius_m = at.head<2>().norm();
      least_m = std::min(least_m, radius_m), greatest_m = std::max(greatest_m, radius_m);
      ASSERT_NEAR(at.z(), 0.41, 0.1);
      ASSERT_NEAR(std::asin(-forward.z()), 12.5 * kDegree, 5 * kDegree);
      ASSERT_GT(forward.head<2>().normalized().dot(at.head<2>() / radius_m), 1 - 1e-9);
      ASSERT_NEAR((world_from_cam.rotation() * Eigen::Vector3d::UnitX()).z(), 0, 1e-9);
    }
    EXPECT_GE(least_m, 0.8);
    EXPECT_LE(greatest_m, 1.0);
    EXPECT_GT(greatest_m - least_m, 0.02);  // no perfect circle
  }
}

TEST(Trajectory, LoopComesBackFromTheOtherSideEachLap) {
  std::set<bool> left_first;
  for (uint64_t seed = 0; seed < 10; ++seed) {
    const Trajectory trajectory(Kind::kLoop, seed);
    const Pose<World, Cam> start = trajectory.at({});
    EXPECT_GT(trajectory.time_of_lap(1), seconds(12));
    EXPECT_LT(trajectory.time_of_lap(1), seconds(20));
    for (const int count : {1, 2, 7}) {
      const Pose<World, Cam> back = trajectory.at(trajectory.time_of_lap(count));
      EXPECT_LT((back.translation() - start.translation()).norm(), 1e-6);
      EXPECT_LT(back.rotation().angularDistance(start.rotation()), 1e-6);
    }
    const Duration lap = trajectory.time_of_lap(2) - trajectory.time_of_lap(1);
    const Duration half = trajectory.time_of_lap(1) - microseconds(lap.us / 2);
    EXPECT_LT((start.translation() + trajectory.at(half).translation()).head<2>().norm(), 0.1);
    left_first.insert((start.inverse() * trajectory.at(seconds(3)).translation()).x() < 0);
  }
  EXPECT_EQ(left_first.size(), 2u);  // by the seed one way round or the other
}

TEST(Trajectory, DependsOnTheSeedAlone) {
  const Trajectory one(Kind::kDesk, 1), again(Kind::kDesk, 1), other(Kind::kDesk, 2);
  EXPECT_EQ(one.at(seconds(7)).matrix(), again.at(seconds(7)).matrix());
  EXPECT_NE(one.at(seconds(7)).matrix(), other.at(seconds(7)).matrix());
}

}  // namespace
}  // namespace foresight::sim
