#include "procs/renderer/camera_predictor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/renderer/predicted_robot.h"

namespace foresight {
namespace {

class Predictor : public testing::Test {
 protected:
  JointState at_rest(Time t) const {
    const JointVector zero = JointVector::Zero(2);
    return {.time = t,
            .position_rad = zero,
            .velocity_rad_per_s = zero,
            .reference_rad = zero,
            .reference_velocity_rad_per_s = zero,
            .target_rad = zero};
  }
  void make_ready() {
    ASSERT_TRUE(predictor_.set_joint_state(kStart, at_rest(kStart)));
    ASSERT_TRUE(predictor_.set_alignment({7, {}, {}}));
    ASSERT_TRUE(predictor_.set_base(kStart, {kStart, 7, {}}));
  }
  // Let go at kStart, engaged a command later.
  void engage(const JointVector& position_rad) {
    const Time engaged = kStart + kCommandPeriod;
    ASSERT_EQ(predictor_.add_command(kStart, {kStart, 1, 1, false, joints(0, 0)}),
              CommandIntake::kTaken);
    ASSERT_EQ(predictor_.add_command(engaged, {engaged, 1, 2, true, position_rad}),
              CommandIntake::kTaken);
  }
  JointVector joints(double a, double b) const {
    JointVector q(2);
    q << a, b;
    return q;
  }
  CameraPredictor predictor_{two_joints(), {}};
};

TEST_F(Predictor, SaysWhatIsMissing) {
  EXPECT_FALSE(predictor_.predict(kStart));
  EXPECT_EQ(predictor_.reason(), "no JOINT_STATE yet");
  EXPECT_TRUE(predictor_.set_joint_state(kStart, at_rest(kStart)));
  EXPECT_FALSE(predictor_.predict(kStart));
  EXPECT_EQ(predictor_.reason(), "map and robot are not aligned yet");
  EXPECT_TRUE(predictor_.set_alignment({7, {}, {}}));
  EXPECT_FALSE(predictor_.predict(kStart));
  EXPECT_EQ(predictor_.reason(), "no BASE_POSE yet");
  EXPECT_TRUE(predictor_.set_base(kStart, {kStart, 7, {}}));
  EXPECT_TRUE(predictor_.predict(kStart));
  EXPECT_EQ(predictor_.reason(), "");
}

TEST_F(Predictor, StopsWithoutFreshJointStateAndGoesOnWithIt) {
  make_ready();
  for (int i = 1; i <= 20; ++i) {
    const Time t = kStart + milliseconds(10) * i;
    ASSERT_TRUE(predictor_.set_joint_state(t, at_rest(t)));
  }
  const Time last = kStart + milliseconds(200);
  EXPECT_TRUE(predictor_.predict(last + milliseconds(1000)));
  EXPECT_FALSE(predictor_.predict(last + milliseconds(1200)));
  EXPECT_EQ(predictor_.reason(), "no JOINT_STATE for 1.2 s");
  const Time again = last + seconds(5);
  ASSERT_TRUE(predictor_.set_joint_state(again, at_rest(again)));
  EXPECT_TRUE(predictor_.predict(again));
}

TEST_F(Predictor, AClockThatIsSetBackIsNoticedBeforeTheNextMessage) {
  make_ready();
  EXPECT_TRUE(predictor_.predict(kStart));
  EXPECT_FALSE(predictor_.predict(kStart - seconds(3)));
  EXPECT_EQ(predictor_.reason(), "the clock here was set back");
}

TEST_F(Predictor, RefusesWhatIsNotOfThisArmOrOld) {
  make_ready();
  const auto add = [&](Time time, int64_t session, const JointVector& q) {
    return predictor_.add_command(kStart + seconds(1), {time, session, 1, true, q});
  };
  const Time soon = kStart + milliseconds(500);
  EXPECT_EQ(add(soon, 1, JointVector::Zero(4)), CommandIntake::kOtherArm);
  EXPECT_EQ(add(soon, 2, joints(0.1, 0)), CommandIntake::kTaken);
  EXPECT_EQ(add(soon, 2, joints(0.2, 0)), CommandIntake::kOld) << "the same instant";
  EXPECT_EQ(add(soon - milliseconds(1), 2, joints(0.2, 0)), CommandIntake::kOld);
  EXPECT_EQ(add(soon - milliseconds(1), 3, joints(0.2, 0)), CommandIntake::kTaken) << "of another";
  EXPECT_FALSE(predictor_.set_joint_state(kStart, at_rest(kStart))) << "not newer";
  JointState absurd = at_rest(kStart + milliseconds(10));
  absurd.reference_velocity_rad_per_s = joints(1e200, 0);
  EXPECT_FALSE(predictor_.set_joint_state(kStart, absurd));
  absurd = at_rest(kStart + milliseconds(10));
  absurd.command_time = {std::numeric_limits<int64_t>::max()};
  EXPECT_FALSE(predictor_.set_joint_state(kStart, absurd));
}

// One message with an absurd stamp, epoch or limit: the stream that keeps coming wins.
TEST_F(Predictor, NoSingleMessageBendsItForGood) {
  make_ready();
  ControllerState controller{.state = ArmState::kHolding,
                             .limits = {{0.5, 0.5}, 0.1, milliseconds(400)}};
  int predictions_after_s = 0;
  for (int i = 1; i <= 300; ++i) {
    const Time now = kStart + milliseconds(10) * i;
    static_cast<void>(predictor_.set_joint_state(now, at_rest(now)));
    controller.time = now;
    static_cast<void>(predictor_.set_controller(now, controller));
    if (i % 3 == 0) static_cast<void>(predictor_.set_base(now, {now, 7, {}}));
    if (i % 100 == 0) static_cast<void>(predictor_.set_alignment({7, {}, {}}));
    if (i == 100) {
      for (const int64_t us :
           {std::numeric_limits<int64_t>::max(), int64_t{0}, std::numeric_limits<int64_t>::min(),
            (now + seconds(0.9)).us, (now + seconds(1e6)).us, (now - seconds(1e3)).us}) {
        const int64_t epoch = 9'000'000'000'000'000'000;
        ControllerState forged{.time = {us}, .limits = {{9, 9}, 1, seconds(50)}};
        static_cast<void>(predictor_.set_joint_state(now, at_rest({us})));
        static_cast<void>(predictor_.set_controller(now, forged));
        static_cast<void>(predictor_.set_base(now, {{us}, epoch, {}}));
        static_cast<void>(predictor_.set_base(now, {{us}, 7, {}}));
        static_cast<void>(predictor_.set_alignment({epoch, {}, {}}));
        EXPECT_FALSE(predictor_.set_base(now, {now, 7, {}, {1e300, 0, 0}}));
      }
    }
    if (i > 200 && predictor_.predict(now)) ++predictions_after_s;
  }
  EXPECT_EQ(predictions_after_s, 100);
  EXPECT_EQ(predictor_.limits(), controller.limits);
  const Time now = kStart + seconds(3);
  EXPECT_EQ(predictor_.predict(now)->epoch, 7);
  EXPECT_LT(predictor_.predict(now)->world_from_base.translation().norm(), 1e-9);
}

TEST_F(Predictor, ANewMapIsFollowedOnceItPersists) {
  make_ready();
  const auto base = [&](int i, int64_t epoch) {
    const Time t = kStart + milliseconds(33) * i;
    return predictor_.set_base(t, {t, epoch, {}});
  };
  EXPECT_FALSE(predictor_.set_alignment({8, {}, {}})) << "nobody else says so";
  EXPECT_FALSE(base(1, 8));
  EXPECT_FALSE(base(2, 8));
  EXPECT_EQ(predictor_.predict(kStart + milliseconds(66))->epoch, 7);
  EXPECT_TRUE(base(3, 8));
  const auto p = predictor_.predict(kStart + milliseconds(99));
  ASSERT_TRUE(p) << predictor_.reason();
  EXPECT_EQ(p->epoch, 8);
}

TEST_F(Predictor, WithoutPowerTheArmStaysWhereItIs) {
  make_ready();
  ASSERT_TRUE(predictor_.set_controller(kStart, {.time = kStart, .state = ArmState::kIdle}));
  engage(joints(1, 1));
  const auto p = predictor_.predict(kStart + milliseconds(400));
  ASSERT_TRUE(p);
  EXPECT_EQ(p->position_rad, JointVector(JointVector::Zero(2)));
}

TEST_F(Predictor, SaysWhichLimitsDifferAndWhoElseDrives) {
  make_ready();
  EXPECT_EQ(predictor_.limits_note(), "");
  ASSERT_TRUE(predictor_.set_controller(kStart, {.time = kStart, .limits = {}}));
  EXPECT_EQ(predictor_.limits_note(), "") << "the same";
  CameraPredictor slow(two_joints(), {});
  ASSERT_TRUE(
      slow.set_controller(kStart, {.time = kStart, .limits = {{0.15, 1}, 0.05, seconds(0.5)}}));
  EXPECT_EQ(slow.limits_note(),
            "the controller's limits are followed: 0.15 rad/s instead of 1 rad/s");
  engage(joints(1, 1));
  const Time now = kStart + seconds(1);
  ASSERT_TRUE(predictor_.set_controller(
      now, {.time = now, .state = ArmState::kFollowing, .driver_session = 77}));
  EXPECT_NE(predictor_.commanders_complaint(now).find("not at this site"), std::string::npos);
  const int64_t absurd = std::numeric_limits<int64_t>::min();
  ASSERT_TRUE(predictor_.set_controller(now, {.time = now, .driver_session = absurd}));
  EXPECT_NE(predictor_.commanders_complaint(now).find("at no possible time"), std::string::npos);
}

TEST_F(Predictor, TheArmLagsBehindItsReferenceAsItDid) {
  JointState state = at_rest(kStart);
  state.position_rad = joints(0.003, -0.001);
  ASSERT_TRUE(predictor_.set_joint_state(kStart, state));
  ASSERT_TRUE(predictor_.set_alignment({7, {}, {}}));
  ASSERT_TRUE(predictor_.set_base(kStart, {kStart, 7, {}}));
  const auto p = predictor_.predict(kStart + milliseconds(100));
  ASSERT_TRUE(p);
  EXPECT_TRUE(p->position_rad.isApprox(state.position_rad));
}

TEST_F(Predictor, CommandModeShowsTheCommandInsideTheLimits) {
  predictor_ = CameraPredictor(two_joints(), {.joints = PredictedJoints::kCommand});
  make_ready();
  engage(joints(5, -1));
  const auto p = predictor_.predict(kStart + kCommandPeriod);
  ASSERT_TRUE(p);
  EXPECT_DOUBLE_EQ(p->position_rad[0], 1.95);
  EXPECT_DOUBLE_EQ(p->position_rad[1], -1);
}

TEST_F(Predictor, TheBaseGoesOnWithItsVelocity) {
  predictor_ = CameraPredictor(two_joints(), {.longest_silence = seconds(60)});
  make_ready();
  const Time then = kStart + milliseconds(100);
  EXPECT_TRUE(predictor_.set_base(then, {then, 7, {}, {0.1, 0, 0}, {0, 0, 0.2}}));
  const auto p = predictor_.predict(then + milliseconds(500));
  ASSERT_TRUE(p);
  EXPECT_NEAR(p->world_from_base.translation().x(), 0.05, 1e-12);
  EXPECT_NEAR(Eigen::AngleAxisd(p->world_from_base.rotation()).angle(), 0.1, 1e-9);
  const auto late = predictor_.predict(kStart + seconds(20));
  EXPECT_NEAR(late->world_from_base.translation().x(), 0.15, 1e-12) << "not for ever";
}

// A ship's heave: 10 cm, 6 s. 0.3 s ahead at full acceleration.
TEST_F(Predictor, TheBaseKeepsItsAccelerationForAWhile) {
  predictor_ = CameraPredictor(two_joints(), {.longest_silence = seconds(60)});
  make_ready();
  const double rate = 2 * 3.14159265 / 6;
  const auto height_m = [&](double t_s) { return 0.1 * std::cos(rate * t_s); };
  for (int i = 0; i <= 90; ++i) {
    const double t_s = i / 30.0;
    BaseState base{kStart + seconds(t_s), 7, {}, {0, 0, -0.1 * rate * std::sin(rate * t_s)}, {}};
    base.world_from_base = {Eigen::Quaterniond::Identity(), {0, 0, height_m(t_s)}};
    EXPECT_EQ(predictor_.set_base(base.time, base), i > 0)
        << "the first is not newer than make_ready()'s";
  }
  EXPECT_FALSE(predictor_.set_base(kStart + seconds(3), {kStart + milliseconds(2500), 7, {}}))
      << "not newer";
  const auto p = predictor_.predict(kStart + milliseconds(3300));
  ASSERT_TRUE(p);
  const double error_m = std::abs(p->world_from_base.translation().z() - height_m(3.3));
  const double by_velocity_m =
      std::abs(height_m(3) - 0.1 * rate * std::sin(3 * rate) * 0.3 - height_m(3.3));
  EXPECT_LT(error_m, 0.4 * by_velocity_m);
}

TEST_F(Predictor, TheMapIsReachedThroughTheAlignment) {
  make_ready();
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitY()));
  ASSERT_TRUE(predictor_.set_alignment(
      {7, {2.0, turn, {1, 2, 3}}, {Eigen::Quaterniond::Identity(), {0, 0, 1}}}));
  const auto p = predictor_.predict(kStart);
  ASSERT_TRUE(p);
  // Both joints at 0: the hand is 1 m along x, the camera 1 m above it.
  EXPECT_TRUE(p->world_from_cam.translation().isApprox(Eigen::Vector3d(1, 0, 1)));
  const Eigen::Vector3d in_map = turn.conjugate() * (Eigen::Vector3d(0, -2, -2) / 2.0);
  EXPECT_TRUE(p->map_from_cam.translation().isApprox(in_map));
}

}  // namespace
}  // namespace foresight
