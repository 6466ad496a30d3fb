// Every way from one mode of the safety board to another, and the ways that must not exist.
#include "sim/arm/safety_board.h"

#include <gtest/gtest.h>

#include "foresight/arm_encoders_t.hpp"
#include "foresight/pendant_t.hpp"
#include "tests/sim/test_arms.h"

namespace foresight::sim {
namespace {

constexpr ArmSpeeds kResting{0.01, 0.01}, kTooFast{1.2, 0.4};

class Board : public testing::Test {
 protected:
  void begin(SafetyMode mode) {
    board_ = SafetyBoard({.motor_torque_nm = JointVector::Constant(4, 2.0)}, mode);
  }
  void watch(const ArmSpeeds& speeds, Duration duration) {
    for (Duration t; t < duration; t = t + milliseconds(2)) {
      now_ = now_ + milliseconds(2);
      board_.watch(speeds, now_);
    }
  }
  void send_torques(double torque_nm, int times = kTorquesToBegin) {
    for (int i = 0; i < times; ++i) {
      board_.on_torques(JointVector::Constant(4, torque_nm), now_);
    }
  }
  void press(int8_t button) { board_.press(button, now_); }
  Time now_{1'000'000};
  SafetyBoard board_{{.motor_torque_nm = JointVector::Constant(4, 2.0)}, SafetyMode::kActive};
};

TEST_F(Board, NumbersItsModesAsTheMessageDoes) {
  EXPECT_EQ(static_cast<int8_t>(SafetyMode::kEstop), +arm_encoders_t::SAFETY_ESTOP);
  EXPECT_EQ(static_cast<int8_t>(SafetyMode::kIdle), +arm_encoders_t::SAFETY_IDLE);
  EXPECT_EQ(static_cast<int8_t>(SafetyMode::kActive), +arm_encoders_t::SAFETY_ACTIVE);
}

TEST_F(Board, WarnsAboveHalfAMetrePerSecond) {
  board_.watch({0.45, 0.1}, now_);
  EXPECT_FALSE(board_.is_warning());
  board_.watch({0.55, 0.1}, now_);
  EXPECT_TRUE(board_.is_warning());
  EXPECT_EQ(board_.mode(), SafetyMode::kActive);
  board_.watch({0.1, 0.55}, now_);
  EXPECT_TRUE(board_.is_warning());
  board_.watch(kResting, now_);
  EXPECT_FALSE(board_.is_warning());
}

TEST_F(Board, ATipThatIsTooFastIsAFault) {
  board_.watch({0.99, 0.1}, now_);
  EXPECT_EQ(board_.mode(), SafetyMode::kActive);
  board_.watch({1.01, 0.1}, now_);
  EXPECT_EQ(board_.mode(), SafetyMode::kIdle);
  EXPECT_NE(board_.fault().find("tip"), std::string::npos) << board_.fault();
}

TEST_F(Board, AnElbowThatIsTooFastIsAFault) {
  board_.watch({0.1, 1.01}, now_);
  EXPECT_EQ(board_.mode(), SafetyMode::kIdle);
  EXPECT_NE(board_.fault().find("elbow"), std::string::npos) << board_.fault();
}

TEST_F(Board, TooMuchTorqueIsAFault) {
  send_torques(-1.99);
  EXPECT_TRUE(board_.is_driven());
  send_torques(-2.01);
  EXPECT_EQ(board_.mode(), SafetyMode::kIdle);
  EXPECT_NE(board_.fault().find("motor 1"), std::string::npos) << board_.fault();
}

// Anybody may send one.
TEST_F(Board, OneForgedTorqueIsNoFaultHoweverLarge) {
  send_torques(0);
  for (int i = 0; i < 100; ++i) {
    send_torques(i % 3 == 0 ? 1e6 : 0.1, 1);
    watch(kResting, milliseconds(2));
  }
  EXPECT_TRUE(board_.is_driven());
  EXPECT_EQ(board_.fault(), "");
}

TEST_F(Board, OneForgedTorqueIsNoControllerWhoseSilenceMatters) {
  send_torques(0.1, kTorquesToBegin - 1);
  EXPECT_FALSE(board_.is_driven());
  watch(kResting, seconds(1));
  EXPECT_EQ(board_.mode(), SafetyMode::kActive);
  send_torques(0.1, kTorquesToBegin - 1);
  EXPECT_FALSE(board_.is_driven()) << "not in a row";
  send_torques(0.1, 1);
  EXPECT_TRUE(board_.is_driven());
}

TEST_F(Board, AControllerThatFallsSilentIsAFault) {
  watch(kResting, seconds(1));
  EXPECT_EQ(board_.mode(), SafetyMode::kActive) << "it has not begun";
  send_torques(0);
  watch(kResting, milliseconds(50));
  EXPECT_TRUE(board_.is_driven());
  watch(kResting, milliseconds(4));
  EXPECT_EQ(board_.mode(), SafetyMode::kIdle);
  EXPECT_NE(board_.fault().find("torques"), std::string::npos) << board_.fault();
}

TEST_F(Board, TimeThatWasNotWatchedIsNoSilence) {
  send_torques(0);
  now_ = now_ + seconds(3);
  board_.pass_over(seconds(3));
  watch(kResting, milliseconds(10));
  EXPECT_TRUE(board_.is_driven());
}

TEST_F(Board, AnArmThatBrakesInTimeStaysIdle) {
  watch(kTooFast, milliseconds(490));
  EXPECT_EQ(board_.mode(), SafetyMode::kIdle);
  watch(kResting, seconds(1));
  EXPECT_EQ(board_.mode(), SafetyMode::kIdle);
}

TEST_F(Board, AnArmThatIsStillTooFastAfterHalfASecondIsStopped) {
  watch(kTooFast, milliseconds(500));
  EXPECT_EQ(board_.mode(), SafetyMode::kIdle);
  watch(kTooFast, milliseconds(4));
  EXPECT_EQ(board_.mode(), SafetyMode::kEstop);
  EXPECT_NE(board_.fault().find("braking"), std::string::npos) << board_.fault();
}

TEST_F(Board, SoftwareCannotLeaveIdleOrEstop) {
  for (const SafetyMode mode : {SafetyMode::kIdle, SafetyMode::kEstop}) {
    begin(mode);
    for (int i = 0; i < 1000; ++i) {
      send_torques(0.1);
      watch(kResting, milliseconds(2));
    }
    EXPECT_EQ(board_.mode(), mode);
    EXPECT_FALSE(board_.is_driven());
  }
}

TEST_F(Board, APersonLeadsItFromEstopToActive) {
  begin(SafetyMode::kEstop);
  press(pendant_t::BUTTON_ACTIVATE);
  EXPECT_EQ(board_.mode(), SafetyMode::kEstop) << "idle comes first";
  press(pendant_t::BUTTON_IDLE);
  EXPECT_EQ(board_.mode(), SafetyMode::kIdle);
  press(pendant_t::BUTTON_ACTIVATE);
  EXPECT_EQ(board_.mode(), SafetyMode::kActive);
  EXPECT_FALSE(board_.is_driven()) << "the motors wait for torques";
  send_torques(0);
  EXPECT_TRUE(board_.is_driven());
}

TEST_F(Board, EstopAndIdleButtonsWorkInEveryMode) {
  for (const SafetyMode mode : {SafetyMode::kEstop, SafetyMode::kIdle, SafetyMode::kActive}) {
    begin(mode);
    press(pendant_t::BUTTON_ESTOP);
    EXPECT_EQ(board_.mode(), SafetyMode::kEstop);
    EXPECT_FALSE(board_.fault().empty());
    begin(mode);
    press(pendant_t::BUTTON_IDLE);
    EXPECT_EQ(board_.mode(), SafetyMode::kIdle);
    EXPECT_EQ(board_.fault(), "");
  }
}

TEST_F(Board, UnknownButtonsDoNothing) {
  for (const int button : {-1, 3, 100}) press(static_cast<int8_t>(button));
  EXPECT_EQ(board_.mode(), SafetyMode::kActive);
}

TEST_F(Board, ActivationClearsTheFaultAndWaitsForANewHeartbeat) {
  send_torques(5);
  EXPECT_FALSE(board_.fault().empty());
  press(pendant_t::BUTTON_ACTIVATE);
  EXPECT_EQ(board_.fault(), "");
  watch(kResting, seconds(1));
  EXPECT_EQ(board_.mode(), SafetyMode::kActive);
}

TEST(ArmSpeeds, AreThoseOfTheElbowAndOfAPointOnTheForearm) {
  for (const char* name : {"wam4", "wam7"}) {
    const ArmDynamics dynamics(load_arm(name));
    const int n = dynamics.size();
    // The first axis is vertical; stretched out sideways, distance from it gives the speed.
    JointVector q = JointVector::Zero(n);
    q[1] = 1.5707963267948966;
    const ArmSpeeds turning = measure_speeds(dynamics, q, JointVector::Unit(n, 0));
    EXPECT_NEAR(turning.elbow_m_per_s, 0.55, 1e-9) << name;
    EXPECT_NEAR(turning.tip_m_per_s, 0.55 + 0.35, 1e-9) << name;
    const ArmSpeeds bending = measure_speeds(dynamics, q, JointVector::Unit(n, 3));
    EXPECT_NEAR(bending.elbow_m_per_s, 0, 1e-9) << name;
    EXPECT_NEAR(bending.tip_m_per_s, std::hypot(0.35, 0.045), 1e-9) << name;
  }
}

}  // namespace
}  // namespace foresight::sim
