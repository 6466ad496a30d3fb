// The controller's small parts: command gate, servo, jitter.
#include <gtest/gtest.h>

#include <limits>

#include "procs/wam_controller/command_gate.h"
#include "procs/wam_controller/joint_servo.h"
#include "procs/wam_controller/period_jitter.h"
#include "tests/wam_controller/joints.h"

namespace foresight {
namespace {

constexpr Time kNow{100'000'000};

ArmCommand command(int64_t session, int64_t seq, Time time = kNow) {
  return {time, session, seq, true, 2, joints({0, 0})};
}

class CommandGateTest : public testing::Test {
 protected:
  CommandVerdict admit(const ArmCommand& c) { return gate_.admit(kNow, c); }
  CommandGate gate_{2, seconds(2)};
};

TEST_F(CommandGateTest, KeepsOrderWithinASession) {
  EXPECT_EQ(admit(command(1, 5)), CommandVerdict::kAccepted);
  EXPECT_EQ(admit(command(1, 5)), CommandVerdict::kOutOfOrder);
  EXPECT_EQ(admit(command(1, 4)), CommandVerdict::kOutOfOrder);
  EXPECT_EQ(admit(command(1, 9)), CommandVerdict::kAccepted);
  EXPECT_EQ(gate_.counts().accepted, 2);
  EXPECT_EQ(gate_.counts().out_of_order, 2);
}

TEST_F(CommandGateTest, ANewSessionBeginsAnewAndEndsTheOldOne) {
  EXPECT_EQ(admit(command(10, 500)), CommandVerdict::kAccepted);
  EXPECT_EQ(admit(command(20, 0)), CommandVerdict::kAccepted);
  EXPECT_EQ(admit(command(10, 501)), CommandVerdict::kOutOfOrder);
}

TEST_F(CommandGateTest, DropsWhatIsStale) {
  EXPECT_EQ(admit(command(1, 1, kNow - seconds(2.1))), CommandVerdict::kStale);
  EXPECT_EQ(admit(command(1, 1, kNow - seconds(1.9))), CommandVerdict::kAccepted);
  EXPECT_EQ(gate_.counts().stale, 1);
}

// Else one bad message would lock the operator out.
TEST_F(CommandGateTest, RefusesStampsFromTheFuture) {
  constexpr int64_t kEnd = std::numeric_limits<int64_t>::max();
  EXPECT_EQ(admit(command(kEnd, 0)), CommandVerdict::kRefused);
  EXPECT_EQ(admit(command(1, kEnd, Time{kEnd})), CommandVerdict::kRefused);
  EXPECT_EQ(admit(command(1, 0, Time{std::numeric_limits<int64_t>::min()})),
            CommandVerdict::kStale);
  EXPECT_EQ(admit(command(1, 0)), CommandVerdict::kAccepted);
}

TEST_F(CommandGateTest, RefusesAnotherJointCountAndWhatIsNoNumber) {
  ArmCommand wrong = command(1, 1);
  wrong.joint_count = 3;
  EXPECT_EQ(admit(wrong), CommandVerdict::kRefused);
  ArmCommand nan = command(1, 1);
  nan.position_rad[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(admit(nan), CommandVerdict::kRefused);
  EXPECT_EQ(gate_.counts().refused, 2);
}

TEST_F(CommandGateTest, LettingGoNeedsNoPositions) {
  const ArmCommand let_go{kNow, 1, 1, false, 0, JointVector(0)};
  EXPECT_EQ(admit(let_go), CommandVerdict::kAccepted);
}

class JointServoTest : public testing::Test {
 protected:
  JointServoTest() {
    arm_.joints.resize(1);
    arm_.joints[0].kp = 100;
    arm_.joints[0].ki = 10;
    arm_.joints[0].kd = 2;
    arm_.joints[0].torque_limit_nm = 20;
  }
  JointVector run(JointServo& servo, double error_rad, int steps, double feed_forward_nm = 0) {
    const JointMotion at{joints({error_rad}), joints({0}), joints({0})};
    JointVector torque(1);
    for (int i = 0; i < steps; ++i) {
      servo.measure(joints({0}), 0.002);
      torque = servo.torque_nm(at, joints({feed_forward_nm}), 0.002);
    }
    return torque;
  }
  ArmModel arm_;
};

TEST_F(JointServoTest, SumsPidAndFeedForward) {
  JointServo servo(arm_, 100);
  servo.reset(joints({0}));
  EXPECT_NEAR(run(servo, 0.05, 1, 3)[0], 3 + 5 + 10 * 0.05 * 0.002, 1e-12);
  EXPECT_NEAR(run(servo, 0.05, 999, 3)[0], 3 + 5 + 10 * 0.05 * 2, 1e-9);
}

TEST_F(JointServoTest, StaysWithinTheTorqueLimit) {
  JointServo servo(arm_, 100);
  servo.reset(joints({0}));
  EXPECT_EQ(run(servo, 5, 10)[0], 20);
  EXPECT_EQ(run(servo, -5, 10)[0], -20);
}

// Blocked for a minute, then free on the other side: the torque turns at once.
TEST_F(JointServoTest, TheIntegralDoesNotWindUp) {
  JointServo servo(arm_, 100);
  servo.reset(joints({0}));
  run(servo, 0.5, 30'000);
  EXPECT_LT(run(servo, -0.01, 1)[0], 0);
  run(servo, 0.01, 1'000'000);  // not saturated, but for very long
  EXPECT_LE(run(servo, 0.01, 1)[0], 20);
}

TEST_F(JointServoTest, MeasuresTheVelocityOfAMovingJoint) {
  JointServo servo(arm_, 50);
  servo.reset(joints({0}));
  for (int i = 1; i <= 100; ++i) servo.measure(joints({0.001 * i}), 0.002);
  EXPECT_NEAR(servo.velocity_rad_per_s()[0], 0.5, 1e-9);
  servo.measure(joints({0.101 + 0.0001}), 0.002);  // an error of a tenth of a step
  EXPECT_NEAR(servo.velocity_rad_per_s()[0], 0.5, 0.03);
}

TEST(PeriodJitterTest, TellsTheWorstPercentOfTheLastSecond) {
  PeriodJitter jitter(milliseconds(2));
  EXPECT_EQ(jitter.p99_ms(Time{0}), 0);
  Time now{0};
  for (int i = 0; i < 500; ++i) {
    now = now + (i % 50 == 0 ? microseconds(2500) : milliseconds(2));
    jitter.tick(now);
  }
  EXPECT_NEAR(jitter.p99_ms(now), 0.5, 1e-9);
  EXPECT_EQ(jitter.p99_ms(now + seconds(3)), 0);
  EXPECT_EQ(jitter.p99_ms(now - seconds(3)), 0);
  for (int i = 0; i < 5000; ++i) jitter.tick(now = now + milliseconds(2));
  EXPECT_EQ(jitter.p99_ms(now), 0);
}

}  // namespace
}  // namespace foresight
