// The controller's small parts: servo, jitter.
#include <gtest/gtest.h>

#include "procs/wam_controller/joint_servo.h"
#include "procs/wam_controller/period_jitter.h"
#include "tests/wam_controller/joints.h"

namespace foresight {
namespace {

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
