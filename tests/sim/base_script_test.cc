// The base's motions: from rest at the world's origin, smooth, within their amplitudes.
#include "sim/base/base_script.h"

#include <gtest/gtest.h>

#include "tests/sim/test_arms.h"

namespace foresight::sim {
namespace {

using Kind = BaseScript::Kind;

double turn_rad(const Pose<World, Base>& pose) {
  return pose.rotation().angularDistance(Eigen::Quaterniond::Identity());
}

class EveryScript : public testing::TestWithParam<Kind> {
 protected:
  const BaseScript script_{{.kind = GetParam(), .start_s = 1, .duration_s = 2}};
};

TEST_P(EveryScript, BeginsAtRestWhereTheWorldIs) {
  for (const double time_s : {-1.0, 0.0, 0.5, 1.0}) {
    EXPECT_TRUE(script_.at(time_s).matrix().isIdentity(0));
  }
  EXPECT_LT((script_.at(1.01).translation()).norm(), 1e-6);
  EXPECT_LT(turn_rad(script_.at(1.01)), 1e-6);
}

TEST_P(EveryScript, HasContinuousVelocityAndAcceleration) {
  constexpr double kStep_s = 0.002;
  BaseMotion last = script_.motion_at(0);
  for (double time_s = kStep_s; time_s < 30; time_s += kStep_s) {
    const BaseMotion now = script_.motion_at(time_s);
    ASSERT_LT((now.velocity_m_per_s - last.velocity_m_per_s).norm(), 2e-3) << time_s;
    ASSERT_LT((now.angular_velocity_rad_per_s - last.angular_velocity_rad_per_s).norm(), 2e-3);
    ASSERT_LT((now.acceleration_m_per_s2 - last.acceleration_m_per_s2).norm(), 1e-2) << time_s;
    ASSERT_LT((now.angular_acceleration_rad_per_s2 - last.angular_acceleration_rad_per_s2).norm(),
              1e-2);
    last = now;
  }
}

// Velocities, in the base, lead from one pose to the next.
TEST_P(EveryScript, VelocityIsTheDerivativeOfThePose) {
  constexpr double kStep_s = 1e-3;
  for (double time_s = 0.3; time_s < 20; time_s += 0.37) {
    const BaseMotion motion = script_.motion_at(time_s);
    const Pose<World, Base> now = script_.at(time_s), next = script_.at(time_s + kStep_s);
    const Pose<Base, Base> step = now.inverse() * next;
    EXPECT_LT((step.translation() / kStep_s - motion.velocity_m_per_s).norm(), 1e-3) << time_s;
    EXPECT_NEAR(step.rotation().angularDistance(Eigen::Quaterniond::Identity()) / kStep_s,
                motion.angular_velocity_rad_per_s.norm(), 2e-3);
    EXPECT_NEAR(motion.gravity_m_per_s2.norm(), kGravity_m_per_s2, 1e-9);
    EXPECT_LT((now.rotation() * motion.gravity_m_per_s2 - Eigen::Vector3d(0, 0, -kGravity_m_per_s2))
                  .norm(),
              1e-9);
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, EveryScript,
                         testing::Values(Kind::kStill, Kind::kPush, Kind::kRamp, Kind::kWaves,
                                         Kind::kRandomWalk));

TEST(BaseScript, PushEndsWhereItShould) {
  const BaseScript script({.kind = Kind::kPush,
                           .start_s = 1,
                           .duration_s = 0.5,
                           .amplitude_m = 0.08,
                           .amplitude_rad = 0.1,
                           .direction_rad = 0});
  for (const double time_s : {1.5, 100.0}) {
    EXPECT_LT((script.at(time_s).translation() - Eigen::Vector3d(0.08, 0, 0)).norm(), 1e-12);
    EXPECT_NEAR(turn_rad(script.at(time_s)), 0.1, 1e-12);
  }
  EXPECT_NEAR(script.at(1.25).translation().x(), 0.04, 1e-12);
}

TEST(BaseScript, RampKeepsItsSpeedAndStops) {
  const BaseScript script(
      {.kind = Kind::kRamp, .duration_s = 4, .direction_rad = 0, .speed_m_per_s = 0.05});
  EXPECT_NEAR(script.motion_at(2).velocity_m_per_s.x(), 0.05, 1e-9);
  EXPECT_NEAR(script.at(10).translation().x(), 4 * 0.05, 1e-9);
  EXPECT_EQ(script.motion_at(10).velocity_m_per_s.norm(), 0);
}

TEST(BaseScript, SwingsStayWithinTheirAmplitudes) {
  for (const Kind kind : {Kind::kWaves, Kind::kRandomWalk}) {
    const BaseScript script({.kind = kind, .amplitude_m = 0.1, .amplitude_rad = 0.05});
    double farthest_m = 0, most_rad = 0;
    for (double time_s = 0; time_s < 300; time_s += 0.1) {
      const Pose<World, Base> pose = script.at(time_s);
      farthest_m = std::max(farthest_m, pose.translation().cwiseAbs().maxCoeff());
      most_rad = std::max(most_rad, turn_rad(pose));
    }
    EXPECT_LE(farthest_m, 0.1);
    EXPECT_GT(farthest_m, 0.04) << "it hardly moves";
    EXPECT_LE(most_rad, 0.05 * 1.3);  // three axes at once
    EXPECT_GT(most_rad, 0.02);
  }
}

TEST(BaseScript, TheSeedChoosesTheWalk) {
  const auto place = [](uint64_t seed) {
    return BaseScript({.kind = Kind::kRandomWalk, .seed = seed}).at(12).translation();
  };
  EXPECT_EQ(place(1), place(1));
  EXPECT_GT((place(1) - place(2)).norm(), 1e-3);
}

}  // namespace
}  // namespace foresight::sim
