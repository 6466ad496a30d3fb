// Who may move the arm, and when: whole process in closed loop, with operators who do not let go,
// who are two, whose commands stall, and whose clocks are wrong.
#include <gtest/gtest.h>

#include "tests/wam_controller/rig.h"

namespace foresight {
namespace {

class Driving : public testing::Test {
 protected:
  void drive() {
    rig.start_arm();
    rig.run(milliseconds(200));
    rig.let_go();
    rig.command_for(seconds(0.8), far_away());
    ASSERT_EQ(rig.does(), ArmState::kFollowing);
  }
  // Full speed ahead, for seconds.
  JointVector far_away() const { return rig.arm.home().array() - 1.7; }
  JointVector back() const { return rig.arm.home().array() + 0.2; }
  double moved_since(const JointVector& before) const {
    return (rig.measured() - before).cwiseAbs().maxCoeff();
  }
  // The button stays held for three seconds and moves nothing; let go and pressed again it does.
  void expect_fresh_engage() {
    const JointVector before = rig.measured();
    rig.command_for(seconds(3), far_away());
    EXPECT_LT(moved_since(before), 5e-3);
    EXPECT_EQ(rig.does(), ArmState::kHolding);
    EXPECT_EQ(rig.state().reason, "let go and press again");
    EXPECT_EQ(rig.state().driver_session, 0);
    EXPECT_EQ(rig.state().needs_release, 1);
    EXPECT_EQ(rig.health().state, +health_t::STATE_DEGRADED);
    EXPECT_NE(rig.health().reason.find("let go and press again"), std::string::npos)
        << rig.health().reason;
    rig.let_go();
    rig.run(milliseconds(10));
    EXPECT_EQ(rig.state().needs_release, 0);
    rig.command_for(seconds(2.5), far_away());
    EXPECT_EQ(rig.does(), ArmState::kFollowing);
    EXPECT_EQ(rig.state().driver_session, rig.session);
    EXPECT_GT(moved_since(before), 0.3);
    EXPECT_EQ(rig.health().state, +health_t::STATE_OK) << rig.health().reason;
  }
  // Commands of somebody else, at the same rate.
  joint_command_t make_other(bool engaged) {
    joint_command_t other = rig.make_command(back(), engaged);
    --rig.seq;
    other.session = 500'000'000;
    other.seq = ++other_seq_;
    return other;
  }
  void command_both_for(Duration duration, bool other_engaged) {
    rig.command_for(duration, [&](int) {
      rig.send(make_other(other_engaged));
      return far_away();
    });
  }
  void send_after(Duration delay, const joint_command_t& command) {
    rig.world.inject(rig.world.now() + delay, Domain::kRobot, "JOINT_COMMAND", encode(command));
  }
  // The operator's commands for a while, late on the way, his clock ahead by so much.
  void command_late_for(Duration duration, Duration delay, Duration ahead) {
    const Time end = rig.world.now() + duration;
    while (rig.world.now() < end) {
      joint_command_t command = rig.make_command(far_away());
      command.utime += ahead.us;
      send_after(delay, command);
      rig.run(microseconds(33'333));
    }
  }
  bool health_says(const std::string& text) const {
    return rig.health().state == health_t::STATE_DEGRADED &&
           rig.health().reason.find(text) != std::string::npos;
  }
  Rig rig{Rig::params_of("wam4")};
  int64_t other_seq_ = 0;
};

using FreshEngage = Driving;
using WhoDrives = Driving;
using AfterAStall = Driving;
using OperatorsClock = Driving;
using DroppedCommands = Driving;
using ForgedEncoders = Driving;

// It used to drive off at 1 rad/s: 2.1 rad in 3 s.
TEST_F(FreshEngage, IsNeededAfterAnEstop) {
  drive();
  rig.safety = arm_encoders_t::SAFETY_ESTOP;
  rig.command_for(seconds(0.5), far_away());
  rig.safety = arm_encoders_t::SAFETY_IDLE;
  rig.command_for(seconds(0.5), far_away());
  rig.safety = arm_encoders_t::SAFETY_ACTIVE;
  expect_fresh_engage();
}

TEST_F(FreshEngage, IsNeededAfterIdle) {
  drive();
  rig.safety = arm_encoders_t::SAFETY_IDLE;
  rig.command_for(seconds(0.5), far_away());
  rig.safety = arm_encoders_t::SAFETY_ACTIVE;
  expect_fresh_engage();
}

// Even if the board was idle for one reading only.
TEST_F(FreshEngage, IsNeededAfterAFlickerOfTheBoard) {
  drive();
  rig.safety = arm_encoders_t::SAFETY_IDLE;
  rig.run(milliseconds(2));
  rig.safety = arm_encoders_t::SAFETY_ACTIVE;
  expect_fresh_engage();
}

TEST_F(FreshEngage, IsNeededAfterAFault) {
  drive();
  rig.counts_added = 4000;
  rig.command_for(seconds(0.3), far_away());
  EXPECT_EQ(rig.does(), ArmState::kFault);
  rig.counts_added = 0;
  rig.safety = arm_encoders_t::SAFETY_IDLE;
  rig.command_for(seconds(0.3), far_away());
  rig.safety = arm_encoders_t::SAFETY_ACTIVE;
  expect_fresh_engage();
}

// Nobody pressed anything there.
TEST_F(FreshEngage, IsNeededAfterEncodersWereMissing) {
  drive();
  rig.is_silent = rig.is_blocked = true;
  rig.command_for(seconds(1), far_away());
  rig.is_silent = rig.is_blocked = false;
  expect_fresh_engage();
}

TEST_F(FreshEngage, IsNeededWhenTheControllerRestartsInMidSession) {
  drive();
  rig.restart();
  expect_fresh_engage();
}

TEST_F(FreshEngage, IsNeededWhenTheButtonWasPressedBeforeTheArmWasReady) {
  rig.safety = arm_encoders_t::SAFETY_IDLE;
  rig.start_arm();
  rig.run(milliseconds(200));
  rig.let_go();
  rig.command_for(seconds(0.5), far_away());
  rig.safety = arm_encoders_t::SAFETY_ACTIVE;
  expect_fresh_engage();
}

TEST_F(WhoDrives, IsNotChangedByASecondOperatorHoweverNewHisSession) {
  drive();
  joint_command_t other = make_other(true);
  other.session = rig.world.now().us;
  rig.send(other);
  const size_t before = rig.joint_states.size();
  command_both_for(seconds(1.5), true);
  EXPECT_EQ(rig.state().driver_session, rig.session);
  EXPECT_NEAR(static_cast<double>(rig.state().commands_of_others), 46, 1);
  for (size_t i = before; i < rig.joint_states.size(); ++i) {
    ASSERT_EQ(rig.joint_states[i].target_position_rad[0], far_away()[0]);
  }
  EXPECT_TRUE(health_says("a second operator commands: session 500000000")) << rig.health().reason;
  rig.command_for(seconds(2), far_away());
  EXPECT_EQ(rig.health().state, +health_t::STATE_OK) << rig.health().reason;
}

TEST_F(WhoDrives, IsNotChangedByAnothersLettingGo) {
  drive();
  command_both_for(seconds(1), false);
  EXPECT_EQ(rig.does(), ArmState::kFollowing);
  EXPECT_EQ(rig.state().driver_session, rig.session);
  EXPECT_EQ(rig.health().state, +health_t::STATE_OK) << rig.health().reason;
}

// It used to drive off for the other one at once.
TEST_F(WhoDrives, IsNobodyWhenTheFirstLetsGoThoughAnotherHoldsHisButton) {
  drive();
  rig.send(make_other(false));
  command_both_for(seconds(0.5), true);
  rig.let_go();
  rig.run(seconds(1.2));
  const JointVector before = rig.measured();
  for (int i = 0; i < 30; ++i) {
    rig.send(make_other(true));
    rig.run(milliseconds(33));
  }
  EXPECT_LT(moved_since(before), 5e-3);
  EXPECT_EQ(rig.state().driver_session, 0);
  rig.send(make_other(false));
  rig.send(make_other(true));
  rig.run(milliseconds(10));
  EXPECT_EQ(rig.state().driver_session, 500'000'000);
}

TEST_F(WhoDrives, IsARestartedOperatorSiteOnceTheOldOnesLeaseIsOver) {
  drive();
  const joint_command_t old = rig.make_command(far_away());
  rig.session += 400'000;
  rig.seq = 0;
  for (int i = 0; i < 20; ++i) {
    rig.let_go();
    rig.run(milliseconds(33));
  }
  rig.command_for(milliseconds(100), back());
  rig.send(old);
  rig.run(milliseconds(20));
  EXPECT_EQ(rig.state().driver_session, rig.session);
  EXPECT_EQ(rig.joint_states.back().target_position_rad[0], back()[0]);
}

// A clock that was behind when the operator's site started: its session is smaller.
TEST_F(WhoDrives, MayHaveAnOlderSessionThanTheOneBefore) {
  drive();
  rig.let_go();
  rig.session -= 600'000'000;
  rig.seq = 0;
  rig.let_go();
  rig.command_for(milliseconds(100), back());
  EXPECT_EQ(rig.state().driver_session, rig.session);
}

TEST_F(WhoDrives, IsNotWhoForgesASessionFromTheFuture) {
  drive();
  for (int i = 0; i < 30; ++i) {
    joint_command_t forged = make_other(i % 2 == 0);
    forged.session = forged.utime + 3'600'000'000;
    rig.send(forged);
    rig.command_for(milliseconds(33), far_away());
  }
  EXPECT_EQ(rig.state().driver_session, rig.session);
  EXPECT_GE(rig.state().commands_refused, 27);
}

// The link stopped for a second at 0.6 s delay, and the clutch was let go meanwhile: 0.26 rad were
// driven afterwards.
TEST_F(AfterAStall, NothingOldIsDrivenThoughTheClutchWasLetGo) {
  rig.start_arm();
  rig.run(milliseconds(200));
  send_after(milliseconds(600), rig.make_command(far_away(), false));
  command_late_for(seconds(1.5), milliseconds(600), {});
  ASSERT_EQ(rig.does(), ArmState::kFollowing);
  rig.run(milliseconds(600));  // what was on its way arrives; then a second of silence
  std::vector<joint_command_t> held_back;
  for (int i = 0; i < 30; ++i) {
    held_back.push_back(rig.make_command(far_away(), i < 10));
    rig.run(microseconds(33'333));
  }
  rig.run(milliseconds(600));
  const JointVector before = rig.measured();
  ASSERT_EQ(rig.does(), ArmState::kHolding);
  for (const joint_command_t& command : held_back) {
    rig.send(command);
    rig.run(milliseconds(2));
  }
  rig.run(seconds(2));
  EXPECT_LT(moved_since(before), 5e-3);
}

TEST_F(AfterAStall, AHeldButtonMustBePressedAgain) {
  drive();
  rig.run(seconds(1.7));
  expect_fresh_engage();
}

TEST_F(AfterAStall, AShortOneIsBridged) {
  drive();
  rig.run(milliseconds(400));
  rig.command_for(milliseconds(200), far_away());
  EXPECT_EQ(rig.does(), ArmState::kFollowing);
}

TEST_F(OperatorsClock, ThatIsAheadIsSaidWithItsOffset) {
  drive();
  command_late_for(seconds(3), milliseconds(50), milliseconds(350));
  EXPECT_TRUE(health_says("clock is at least 300 ms ahead")) << rig.health().reason;
  EXPECT_NEAR(rig.metric("command_age_ms"), -300, 1);
  EXPECT_NEAR(rig.metric("operator_clock_ahead_ms"), 300, 1);
}

TEST_F(OperatorsClock, ThatIsFarAheadIsNamedAsTheReasonOfRefusals) {
  drive();
  command_late_for(seconds(3), milliseconds(50), seconds(3));
  EXPECT_NE(rig.does(), ArmState::kFollowing);
  EXPECT_TRUE(health_says("stamped in the future")) << rig.health().reason;
  EXPECT_TRUE(health_says("clock is at least 2950 ms ahead")) << rig.health().reason;
}

TEST_F(OperatorsClock, ThatIsRightIsNotComplainedOf) {
  drive();
  command_late_for(seconds(3), milliseconds(50), {});
  EXPECT_EQ(rig.health().state, +health_t::STATE_OK) << rig.health().reason;
  EXPECT_NEAR(rig.metric("command_age_ms"), 50, 1);
  EXPECT_EQ(rig.metric("operator_clock_ahead_ms"), 0);
}

TEST_F(OperatorsClock, ThatIsSetInMidSessionIsSaid) {
  drive();
  for (const int64_t step_ms : {-300, 200}) {
    SCOPED_TRACE(step_ms);
    command_late_for(seconds(3), milliseconds(400), {});  // what they usually take
    command_late_for(seconds(3), milliseconds(400), milliseconds(step_ms));
    EXPECT_TRUE(health_says("clock was set by " + std::to_string(step_ms) + " ms"))
        << rig.health().reason;
    rig.run(seconds(1));
    rig.let_go();
    command_late_for(seconds(12), milliseconds(400), {});
  }
}

TEST_F(OperatorsClock, AStallOfLinkOrDeviceIsNotTakenForASetClock) {
  drive();
  command_late_for(seconds(2), milliseconds(100), {});
  command_late_for(seconds(1), milliseconds(450), {});
  rig.run(milliseconds(400));  // the operator's site hangs
  command_late_for(seconds(1), milliseconds(450), {});
  command_late_for(seconds(1), milliseconds(100), {});
  EXPECT_EQ(rig.health().reason.find("clock was set"), std::string::npos) << rig.health().reason;
}

TEST_F(DroppedCommands, AreNeverOkWhateverTheirFault) {
  const auto wrong_joints = [&] { return rig.make_command(JointVector::Constant(7, 0.1)); };
  const auto no_number = [&] { return rig.make_command(JointVector::Constant(4, NAN)); };
  const auto stale = [&] {
    joint_command_t command = rig.make_command(far_away());
    command.utime -= 3'000'000;
    return command;
  };
  const auto replayed = [&] {
    joint_command_t command = rig.make_command(far_away());
    command.seq = 1;
    return command;
  };
  const std::vector<std::pair<std::string, std::function<joint_command_t()>>> kinds{
      {"60 with another number of joints", wrong_joints},
      {"60 damaged, or with what is no number", no_number},
      {"older than one that is already here", replayed},
      {"60 too old, or out of a stall", stale}};
  drive();
  for (const auto& [words, make] : kinds) {
    SCOPED_TRACE(words);
    rig.let_go();
    rig.command_for(seconds(2.1), far_away());
    ASSERT_EQ(rig.health().state, +health_t::STATE_OK) << rig.health().reason;
    rig.let_go();
    rig.run(seconds(1.05));
    for (int i = 0; i < 60; ++i) rig.send(make());
    bool was_said = false;
    for (int i = 0; i < 20 && !was_said; ++i) {
      rig.run(milliseconds(100));
      was_said = health_says(words);
    }
    EXPECT_TRUE(was_said) << rig.health().reason;
  }
}

TEST_F(DroppedCommands, AFewLateOnesAreNoFault) {
  drive();
  const joint_command_t a = rig.make_command(far_away()), b = rig.make_command(far_away());
  rig.let_go();
  rig.send(a);
  rig.send(b);
  rig.run(seconds(2.2));
  EXPECT_EQ(rig.health().state, +health_t::STATE_OK) << rig.health().reason;
}

// One reading from the future used to make all later ones old, for as long as it lay ahead.
TEST_F(ForgedEncoders, AReadingFromTheFutureCostsAFreshEngageAndNoMore) {
  for (const int64_t ahead_us : {int64_t{90'000}, int64_t{9'000'000'000'000'000'000}}) {
    SCOPED_TRACE(ahead_us);
    Rig own(Rig::params_of("wam4"));
    own.start_arm();
    own.run(milliseconds(101));
    arm_encoders_t forged = own.make_encoders();
    forged.utime = ahead_us > 1'000'000'000'000 ? ahead_us : forged.utime + ahead_us;
    own.send_encoders(forged);
    const size_t before = own.joint_states.size();
    own.run(milliseconds(50));
    EXPECT_GE(own.joint_states.size(), before + 4);
    EXPECT_EQ(own.does(), ArmState::kHolding);
    EXPECT_LT((own.measured() - own.arm.home()).cwiseAbs().maxCoeff(), 5e-3);
  }
}

TEST_F(ForgedEncoders, AJumpThatNoOtherReadingConfirmsChangesNothing) {
  drive();
  for (int i = 0; i < 20; ++i) {
    arm_encoders_t forged = rig.make_encoders();
    forged.utime += 1000;
    forged.motor_counts[1] += 50'000 * (i % 2 == 0 ? 1 : -1);
    rig.run(milliseconds(1));
    rig.send_encoders(forged);
    rig.run(milliseconds(9));
    rig.send(rig.make_command(far_away()));
  }
  EXPECT_EQ(rig.does(), ArmState::kFollowing) << rig.state().reason;
}

TEST_F(ForgedEncoders, AJumpThatLastsIsAFaultWithItsReason) {
  drive();
  for (int i = 0; i < 2; ++i) {
    arm_encoders_t forged = rig.make_encoders();
    forged.utime += 500 * (i + 1);
    forged.motor_counts[1] += 50'000;
    rig.run(microseconds(500));
    rig.send_encoders(forged);
  }
  rig.run(milliseconds(20));
  EXPECT_EQ(rig.does(), ArmState::kFault);
  EXPECT_NE(rig.state().reason.find("encoder jumped"), std::string::npos) << rig.state().reason;
}

}  // namespace
}  // namespace foresight
