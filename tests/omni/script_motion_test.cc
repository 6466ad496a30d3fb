// The script must be fit to drive a real arm: bounded, inside its limits, smooth; and fit for what
// it is there for: slam's start and the calibration.
#include "procs/omni/script_motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/errors.h"
#include "tests/common/files.h"
#include "tests/omni/arms.h"

namespace foresight {
namespace {

constexpr double kMargin_rad = 0.05;
constexpr double kStep_s = 0.01;
constexpr double kLasting_s = 180;

struct Script {
  Script(const ArmModel& a, const ScriptOptions& options, JointMapping m = paper_mapping())
      : arm(a),
        mapping(std::move(m)),
        motion(plan_script_axes(arm, mapping, kOmniRanges, kMargin_rad, options), options) {}
  JointVector arm_rad(double time_s) const {
    return map_positions(mapping, arm, motion.at(time_s));
  }
  JointVector velocity_rad_per_s(double time_s) const {
    return (arm_rad(time_s + kStep_s) - arm_rad(time_s)) / kStep_s;
  }
  ArmModel arm;
  JointMapping mapping;
  ScriptMotion motion;
};

TEST(ScriptMotion, StartsAtRestAtTheArmsHome) {
  for (const bool warm_up : {true, false}) {
    const Script script(wam4(), {.warm_up = warm_up});
    EXPECT_LT((script.arm_rad(-1) - script.arm.home()).norm(), 1e-9);
    EXPECT_LT((script.arm_rad(0) - script.arm.home()).norm(), 1e-9);
    EXPECT_LT(script.velocity_rad_per_s(0).norm(), 0.01);
  }
}

TEST(ScriptMotion, StaysInsideDeviceAndArmAndBelowTheVelocity) {
  for (int seed = 1; seed <= 20; ++seed) {
    const ScriptOptions options{.seed = seed};
    const Script script(wam4(), options);
    const JointVector home = script.arm.home();
    for (double t = 0; t < kLasting_s; t += kStep_s) {
      const auto axes = script.motion.at(t);
      for (size_t i = 0; i < axes.size(); ++i) {
        ASSERT_GE(axes[i], kOmniRanges[i].lower_rad - 1e-9) << t;
        ASSERT_LE(axes[i], kOmniRanges[i].upper_rad + 1e-9) << t;
      }
      const JointVector arm_rad = script.arm_rad(t);
      ASSERT_LT((script.arm.clamp(arm_rad, kMargin_rad) - arm_rad).norm(), 1e-9) << t;
      ASSERT_LE((arm_rad - home).cwiseAbs().maxCoeff(), options.range_rad + 1e-9) << t;
      const double peak = script.velocity_rad_per_s(t).cwiseAbs().maxCoeff();
      ASSERT_LE(peak, options.peak_rad_per_s * 1.001) << "seed " << seed << " at " << t;
      ASSERT_LE(peak, 0.5);
    }
  }
}

TEST(ScriptMotion, IsSmooth) {
  const Script script(wam4(), {});
  JointVector last = script.velocity_rad_per_s(0);
  for (double t = kStep_s; t < kLasting_s; t += kStep_s) {
    const JointVector velocity = script.velocity_rad_per_s(t);
    ASSERT_LT((velocity - last).cwiseAbs().maxCoeff() / kStep_s, 1.0) << t;  // rad/s²
    last = velocity;
  }
}

TEST(ScriptMotion, KeepsTheTipBelowWhatTheSafetyBoardAllows) {
  for (int seed = 1; seed <= 5; ++seed) {
    const Script script(wam4(), {.seed = seed});
    for (double t = 0; t < kLasting_s; t += kStep_s) {
      const auto a = script.arm.base_from_ee(script.arm_rad(t)).translation();
      const auto b = script.arm.base_from_ee(script.arm_rad(t + kStep_s)).translation();
      ASSERT_LT((b - a).norm() / kStep_s, 0.5)
          << t;  // m/s: not even its warning; the fault is at 1
    }
  }
}

TEST(ScriptMotion, WarmsUpWithTranslationAndRotationsAboutTwoAxes) {
  const Script script(wam4(), {});
  EXPECT_GT(script.motion.warm_up_s(), 5);
  EXPECT_LT(script.motion.warm_up_s(), 45);
  double left_m = 0, right_m = 0, yaw_rad = 0, pitch_rad = 0;
  const Pose<Base, Cam> start = script.arm.base_from_cam(script.arm_rad(0));
  for (double t = 0; t < script.motion.warm_up_s(); t += 0.05) {
    const Pose<Base, Cam> pose = script.arm.base_from_cam(script.arm_rad(t));
    const Eigen::Vector3d moved =
        start.rotation().inverse() * (pose.translation() - start.translation());
    left_m = std::min(left_m, moved.x());
    right_m = std::max(right_m, moved.x());
    const Eigen::AngleAxisd turn(start.rotation().inverse() * pose.rotation());
    const Eigen::Vector3d turned_rad = turn.angle() * turn.axis();
    yaw_rad = std::max(yaw_rad, std::abs(turned_rad.y()));
    pitch_rad = std::max(pitch_rad, std::abs(turned_rad.x()));
  }
  EXPECT_GT(right_m - left_m, 0.15) << "sideways";
  EXPECT_GT(yaw_rad, 0.3);
  EXPECT_GT(pitch_rad, 0.3);
}

TEST(ScriptMotion, BeginsByGoingSideways) {
  const Script script(wam4(), {});
  const JointVector home = script.arm.home();
  double side_rad = 0;
  for (double t = 0; t < 10; t += 0.1) {
    const JointVector moved = script.arm_rad(t) - home;
    side_rad = std::max(side_rad, std::abs(moved[0]));
    EXPECT_LT(moved.tail(3).norm(), 1e-9) << t;
  }
  EXPECT_NEAR(side_rad, 0.4, 1e-3);
}

TEST(ScriptMotion, UsesItsRangeAfterwards) {
  const Script script(wam4(), {.warm_up = false});
  JointVector low = script.arm.home(), high = low;
  for (double t = 0; t < kLasting_s; t += 0.1) {
    low = low.cwiseMin(script.arm_rad(t));
    high = high.cwiseMax(script.arm_rad(t));
  }
  EXPECT_GT(high[0] - low[0], 0.4);
  EXPECT_GT(high[1] - low[1], 0.4);
  EXPECT_GT(high[3] - low[3], 0.25);
  EXPECT_EQ(high[2], low[2]);
}

TEST(ScriptMotion, HoldsStillInTurns) {
  const Script script(wam4(), {.warm_up = false, .move_s = 5, .hold_s = 2});
  for (const double held_s : {5.1, 6.9, 12.1, 13.9}) {
    EXPECT_LT((script.arm_rad(held_s) - script.arm_rad(held_s + 0.05)).norm(), 1e-9) << held_s;
  }
  EXPECT_GT(script.velocity_rad_per_s(2.5).norm(), 0.02);
  EXPECT_GT(script.velocity_rad_per_s(9.5).norm(), 0.02);
}

TEST(ScriptMotion, IsAFunctionOfItsSeed) {
  const Script a(wam4(), {.seed = 3}), b(wam4(), {.seed = 3}), c(wam4(), {.seed = 4});
  double difference = 0;
  for (double t = 0; t < 100; t += 0.5) {
    ASSERT_EQ(a.motion.at(t), b.motion.at(t));
    difference = std::max(difference, (a.arm_rad(t) - c.arm_rad(t)).norm());
  }
  EXPECT_GT(difference, 0.05);
}

TEST(ScriptMotion, DrivesTheWristOfSevenJointsToo) {
  const ArmModel arm = wam7();
  JointMapping mapping = paper_mapping();
  mapping.joints.push_back({.axis = 4});
  mapping.joints.push_back({.axis = 5, .offset_rad = -1.2});
  mapping.joints.push_back({.axis = 6});
  const Script script(arm, {}, mapping);
  JointVector reach = JointVector::Zero(7);
  for (double t = 0; t < kLasting_s; t += kStep_s) {
    const JointVector arm_rad = script.arm_rad(t);
    ASSERT_LT((arm.clamp(arm_rad, kMargin_rad) - arm_rad).norm(), 1e-9);
    ASSERT_LE(script.velocity_rad_per_s(t).cwiseAbs().maxCoeff(), 0.4 * 1.001);
    reach = reach.cwiseMax((arm_rad - arm.home()).cwiseAbs());
  }
  for (const int joint : {0, 1, 3, 4, 5, 6}) EXPECT_GT(reach[joint], 0.2) << joint;
}

TEST(ScriptMotion, RefusesAMappingThatCannotReachHome) {
  JointMapping mapping = paper_mapping();
  mapping.axis_signs = {1, 1, 1};
  const std::string line = error_of<ConfigError>(
      [&] { plan_script_axes(wam4(), mapping, kOmniRanges, kMargin_rad, {}); });
  EXPECT_NE(line.find("home of joint 2 needs axis 2 at -0.73"), std::string::npos) << line;
}

}  // namespace
}  // namespace foresight
