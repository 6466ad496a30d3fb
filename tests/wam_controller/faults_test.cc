// What makes the controller let go of the arm, and what brings it back.
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "common/errors.h"
#include "tests/wam_controller/rig.h"

namespace foresight {
namespace {

class Faults : public testing::Test {
 protected:
  void follow() {
    rig.start_arm();
    rig.run(milliseconds(100));
    rig.let_go();
    rig.command_for(milliseconds(600), rig.arm.home().array() - 0.3);
    ASSERT_EQ(rig.does(), ArmState::kFollowing);
    ASSERT_GT(rig.largest_torque_nm(), 0);
  }
  void expect_fault(const std::string& reason) {
    EXPECT_EQ(rig.does(), ArmState::kFault);
    EXPECT_NE(rig.state().reason.find(reason), std::string::npos) << rig.state().reason;
    EXPECT_EQ(rig.largest_torque_nm(), 0);
  }
  // Only a person at the pendant ends a fault, and only the operator's fresh engage moves the arm.
  void expect_recovery_by_pendant() {
    rig.command_for(milliseconds(300), rig.arm.home());
    EXPECT_EQ(rig.does(), ArmState::kFault);
    rig.safety = arm_encoders_t::SAFETY_IDLE;
    rig.fault.clear();
    rig.command_for(milliseconds(100), rig.arm.home());
    EXPECT_EQ(rig.does(), ArmState::kFault);
    rig.safety = arm_encoders_t::SAFETY_ACTIVE;
    rig.command_for(milliseconds(100), rig.arm.home());
    EXPECT_EQ(rig.does(), ArmState::kHolding);
    EXPECT_EQ(rig.state().reason, "let go and press again");
    rig.let_go();
    rig.command_for(milliseconds(100), rig.arm.home());
    EXPECT_EQ(rig.does(), ArmState::kFollowing);
  }
  Rig rig{Rig::params_of("wam4")};
};

TEST_F(Faults, AnEncoderThatJumps) {
  follow();
  rig.counts_added = 4000;  // 0.15 rad of joint 1
  rig.run(milliseconds(10));
  expect_fault("joint 1: encoder jumped");
  rig.counts_added = 0;
  expect_recovery_by_pendant();
}

TEST_F(Faults, ASafetyBoardThatHasOne) {
  follow();
  rig.safety = arm_encoders_t::SAFETY_IDLE;
  rig.fault = "tip above 1 m/s";
  rig.run(milliseconds(10));
  expect_fault("fault of the safety board: tip above 1 m/s");
  expect_recovery_by_pendant();
}

TEST_F(Faults, AnArmThatIsBlocked) {
  follow();
  rig.is_blocked = true;
  rig.command_for(seconds(2), rig.arm.home().array() + 0.3);
  expect_fault("too far from its reference");
  rig.is_blocked = false;
  rig.plant.brake();
  expect_recovery_by_pendant();
}

TEST_F(Faults, EstopIsNoFaultButIdle) {
  follow();
  rig.safety = arm_encoders_t::SAFETY_ESTOP;
  rig.run(milliseconds(10));
  EXPECT_EQ(rig.does(), ArmState::kIdle);
  EXPECT_EQ(rig.state().reason, "E-STOP");
  EXPECT_EQ(rig.largest_torque_nm(), 0);
  rig.safety = arm_encoders_t::SAFETY_IDLE;
  rig.run(milliseconds(10));
  EXPECT_EQ(rig.state().reason, "the arm is not activated (pendant)");
}

TEST_F(Faults, WithoutEncodersItIsIdleAndComesBackWithoutAJump) {
  EXPECT_EQ(rig.states.size(), 0u);
  rig.run(milliseconds(200));
  EXPECT_EQ(rig.does(), ArmState::kIdle);
  EXPECT_EQ(rig.state().reason, "no encoder readings");
  follow();
  rig.is_silent = true;
  rig.is_blocked = true;
  rig.run(milliseconds(300));
  EXPECT_EQ(rig.does(), ArmState::kIdle);
  EXPECT_EQ(rig.state().reason, "no encoder readings");
  rig.is_silent = rig.is_blocked = false;
  const JointVector before = rig.measured();
  rig.run(milliseconds(300));
  EXPECT_EQ(rig.does(), ArmState::kHolding);
  EXPECT_LT((rig.measured() - before).cwiseAbs().maxCoeff(), 5e-3);
}

TEST_F(Faults, GapsAsOfALoadedMachineAreTolerated) {
  follow();
  for (int i = 0; i < 5; ++i) {
    rig.is_silent = true;
    rig.command_for(milliseconds(14), rig.arm.home());
    rig.is_silent = false;
    rig.command_for(milliseconds(200), rig.arm.home());
  }
  EXPECT_EQ(rig.does(), ArmState::kFollowing);
}

TEST_F(Faults, MessagesThatAreNotWhatTheySeem) {
  follow();
  const JointVector nan = JointVector::Constant(4, std::numeric_limits<double>::quiet_NaN());
  rig.send(rig.make_command(nan));
  rig.send(rig.make_command(JointVector::Constant(4, 1e300)));
  arm_encoders_t few = rig.make_encoders();
  few.n_motors = 2;
  few.motor_counts.resize(2);
  rig.send_encoders(few);
  arm_encoders_t odd = rig.make_encoders();
  odd.safety = 9;
  rig.send_encoders(odd);
  arm_encoders_t old = rig.make_encoders();
  old.utime -= 5'000'000;
  rig.send_encoders(old);
  arm_encoders_t future = rig.make_encoders();
  future.utime += 5'000'000;
  rig.send_encoders(future);
  std::mt19937 random(9);
  for (int i = 0; i < 200; ++i) {
    std::vector<uint8_t> bytes = encode(rig.make_encoders());
    bytes[8 + random() % (bytes.size() - 8)] ^= static_cast<uint8_t>(1 + random() % 255);
    bytes.resize(random() % 2 == 0 ? bytes.size() : random() % bytes.size());
    rig.world.inject(rig.world.now(), Domain::kRobot, i % 2 == 0 ? "ARM_ENCODERS" : "JOINT_COMMAND",
                     bytes);
  }
  rig.run(milliseconds(100));
  int64_t rejected = 0;
  for (const PortRecord& port : rig.world.node("wam_controller").ports()) rejected += port.rejected;
  EXPECT_GT(rejected, 100);
  for (const joint_state_t& s : rig.joint_states) {
    for (const double x : s.reference_position_rad) ASSERT_TRUE(std::isfinite(x) && x < 4);
  }
}

TEST_F(Faults, AnExtremeTargetIsOnlyALimitedOne) {
  follow();
  rig.command_for(milliseconds(200), JointVector::Constant(4, 1e300));
  EXPECT_EQ(rig.does(), ArmState::kFollowing);
  EXPECT_NEAR(rig.joint_states.back().target_position_rad[0], 2.55, 1e-12);
}

// Of a world that starts anew, or of a machine whose clock is set.
TEST(ArmControllerTest, AClockThatIsSetBackEndsTheActivityNotTheController) {
  const ArmModel arm = load_arm_file(kArms + "/wam4.yaml");
  ArmController controller(arm, {});
  ArmReading reading{Time{9'000'000'000}, arm.home(), Safety::kActive, false, {}};
  controller.step(reading);
  JointCommand command{reading.time, 1, 1, false, arm.home().array() + 0.1};
  EXPECT_EQ(controller.on_command(reading.time, command), CommandVerdict::kAccepted);
  command.is_engaged = true;
  command.seq = 2;
  EXPECT_EQ(controller.on_command(reading.time, command), CommandVerdict::kAccepted);
  EXPECT_EQ(controller.status().state, ArmState::kFollowing);
  reading.time = Time{1'000'000};
  reading.position_rad.array() += 0.1;
  controller.step(reading);
  EXPECT_EQ(controller.status().state, ArmState::kHolding);
  EXPECT_EQ(controller.snapshot().target_rad, reading.position_rad);
  EXPECT_EQ(controller.snapshot().time, reading.time);
}

TEST_F(Faults, ReadingsThatComeTwiceChangeNothing) {
  follow();
  rig.run(milliseconds(1));
  const size_t before = rig.torques.size();
  arm_encoders_t again = rig.make_encoders();
  again.utime -= 1000;  // of the last tick
  rig.send_encoders(again);
  rig.run(microseconds(1));
  ASSERT_EQ(rig.torques.size(), before + 1);
  EXPECT_EQ(rig.torques[before].motor_torque_nm, rig.torques[before - 1].motor_torque_nm);
}

class WrongHome : public Faults {};

// Half a radian off at power-on used to go unnoticed, though gravity contradicts it.
TEST_F(WrongHome, IsContradictedByTheWeightAndFollowsNobody) {
  rig.home_error_rad[1] = 0.5;
  rig.start_arm();
  rig.run(seconds(1.2));
  EXPECT_EQ(rig.does(), ArmState::kHolding);
  EXPECT_NE(rig.state().reason.find("joint 2: holding it takes another torque than its weight"),
            std::string::npos)
      << rig.state().reason;
  EXPECT_EQ(rig.health().state, +health_t::STATE_DEGRADED);
  EXPECT_GT(rig.metric("weight_error_nm"), 3);
  std::printf("0.5 rad off at joint 2: %.2f N·m from its weight\n", rig.metric("weight_error_nm"));
  const JointVector before = rig.measured();
  rig.let_go();
  rig.command_for(seconds(1), rig.arm.home().array() - 0.3);
  EXPECT_LT((rig.measured() - before).cwiseAbs().maxCoeff(), 5e-3);
  rig.plant.position[1] += 0.5;  // a person mends it
  rig.home_error_rad[1] = 0;
  rig.command_for(seconds(2), rig.arm.home().array() - 0.3);
  EXPECT_EQ(rig.state().reason, "let go and press again");
  rig.let_go();
  rig.command_for(seconds(0.5), rig.arm.home().array() - 0.3);
  EXPECT_EQ(rig.does(), ArmState::kFollowing);
}

TEST_F(WrongHome, IsNotSuspectedOfAnArmThatStandsWhereItSays) {
  rig.start_arm();
  rig.run(seconds(3));
  EXPECT_LT(rig.metric("weight_error_nm"), 0.1);
  EXPECT_EQ(rig.health().state, +health_t::STATE_OK);
}

TEST(ArmControllerTest, AnArmThatIsToBeWeighedFirstFollowsNobodyBefore) {
  const ArmModel arm = load_arm_file(kArms + "/wam4.yaml");
  ControllerOptions options;
  options.is_weighed_first = true;
  ArmController controller(arm, options);
  ArmReading reading{Time{1'000'000}, arm.home(), Safety::kActive, false, {}};
  JointCommand command{reading.time, 1, 0, false, arm.home().array() + 0.1};
  int first_followed = 0;
  for (int i = 1; i < 1000 && first_followed == 0; ++i) {
    reading.time = command.time = reading.time + milliseconds(2);
    controller.step(reading);
    if (i == 1) {
      EXPECT_STREQ(to_string(controller.status().reason), "is being weighed");
    }
    command.seq = i;
    command.is_engaged = i % 2 == 0;
    (void)controller.on_command(reading.time, command);
    if (controller.status().state == ArmState::kFollowing) first_followed = i;
  }
  EXPECT_NEAR(first_followed, 501, 3);
}

TEST(Start, RefusesWhatCannotWork) {
  const auto refusal = [](const WamControllerParams& params) -> std::string {
    try {
      Rig rig(params);
    } catch (const StartupError& e) {
      return e.what();
    }
    return "";
  };
  WamControllerParams params = Rig::params_of("wam4");
  params.limit_margin_rad = 1;
  EXPECT_EQ(refusal(params), "");
  params.limit_margin_rad = 2.1;
  EXPECT_NE(refusal(params).find("limit_margin_rad"), std::string::npos);
  params = Rig::params_of("wam4");
  params.hardware = Hardware::kCan;
  EXPECT_NE(refusal(params).find("can_torque_units_per_nm"), std::string::npos);
  params.can_torque_units_per_nm.assign(4, 1000);
  params.can_interface = "nocan7";
  EXPECT_NE(refusal(params).find("nocan7"), std::string::npos);
}

}  // namespace
}  // namespace foresight
