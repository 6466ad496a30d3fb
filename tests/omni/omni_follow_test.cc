// What omni does about a robot that does not follow, or is not there.
#include "tests/omni/omni_fixture.h"

namespace foresight {
namespace {

class OmniFollowTest : public OmniProcessTest {};

TEST_F(OmniFollowTest, AButtonThatIsHeldAtTheStartMovesNothing) {
  start(true);
  press(true, 3);
  EXPECT_FALSE(is_engaged());
  expect_degraded("let go of the clutch and press it again (");
  EXPECT_EQ(reason_.find("()"), std::string::npos) << reason_;
}

TEST_F(OmniFollowTest, ACommandDoesNotRunAheadOfAnArmThatDoesNotFollow) {
  for (const double delay_s : {0.0, 0.6}) {
    start_with_sticks({-1, 0, 0, 0, 0});
    robot_->delay = seconds(delay_s);
    run(2 * delay_s + 0.1);
    robot_->set_state(controller_state_t::STATE_IDLE, "E-STOP");
    const double stopped_rad = robot_->position_rad[0];
    run(delay_s + 0.1);
    EXPECT_FALSE(is_engaged());
    run(5);
    EXPECT_NEAR(command_rad(0), stopped_rad, 1e-9) << "the measured arm";
    expect_degraded("the arm is idle: E-STOP");
    robot_->be_ready();
    run(5);
    EXPECT_FALSE(is_engaged()) << "held all the time";
    EXPECT_NEAR(robot_->position_rad[0], stopped_rad, 1e-9);
    expect_degraded("let go of the clutch and press it again (the arm is idle: E-STOP)");
    press(false, 0.1);
    press(true, 0.034);
    EXPECT_TRUE(is_engaged());
    EXPECT_NEAR(command_rad(0), stopped_rad, 0.02) << "begins at the arm";
    run(2 * delay_s + 2);
    EXPECT_TRUE(is_engaged());
    EXPECT_GT(robot_->position_rad[0], stopped_rad + 0.5);
    EXPECT_EQ(state(), ProcessState::kOk);
  }
}

// The last command has run ahead for a round trip, and a quick press must not go on from it.
TEST_F(OmniFollowTest, AQuickPressAfterALossBeginsAtTheArm) {
  start_with_sticks({-1, 0, 0, 0, 0});
  robot_->delay = seconds(0.6);
  run(1.3);
  robot_->can_follow = false;
  robot_->set_state(controller_state_t::STATE_IDLE, "E-STOP");
  const double stopped_rad = robot_->position_rad[0];
  run(0.05);
  robot_->be_ready();
  run(0.7);
  press(false, 0.1);
  press(true, 0.034);
  EXPECT_TRUE(is_engaged());
  EXPECT_NEAR(command_rad(0), stopped_rad, 0.02);
}

TEST_F(OmniFollowTest, SaysAFaultInTheControllersWordsThoughNobodyPresses) {
  start(true);
  run(1);
  EXPECT_EQ(state(), ProcessState::kOk);
  robot_->set_state(controller_state_t::STATE_FAULT, "joint 2: too far from its reference");
  run(0.1);
  expect_degraded("the arm has a fault: joint 2: too far from its reference");
}

TEST_F(OmniFollowTest, SaysThatAnotherOperatorDrives) {
  start_with_sticks({0, 0, 0, 0, 0});
  robot_->set_state(controller_state_t::STATE_FOLLOWING, "", 4711);
  run(0.1);
  EXPECT_FALSE(is_engaged());
  expect_degraded("another operator drives (session 4711)");
}

TEST_F(OmniFollowTest, LetsGoWhenTheControllerNeedsIt) {
  start_with_sticks({-1, 0, 0, 0, 0});
  robot_->set_state(controller_state_t::STATE_HOLDING, "let go and press again", 0, true);
  run(0.1);
  EXPECT_FALSE(is_engaged());
  robot_->be_ready();
  run(1);
  EXPECT_FALSE(is_engaged());
}

TEST_F(OmniFollowTest, ASilentRobotEndsAnEngagement) {
  for (const bool joints : {true, false}) {
    start_with_sticks({-1, 0, 0, 0, 0});
    (joints ? robot_->says_joints : robot_->says_state) = false;
    run(0.9);
    EXPECT_TRUE(is_engaged()) << "a few lost messages";
    run(0.3);
    EXPECT_FALSE(is_engaged());
    expect_degraded(joints ? "no JOINT_STATE" : "no CONTROLLER_STATE");
    (joints ? robot_->says_joints : robot_->says_state) = true;
    run(1);
    EXPECT_FALSE(is_engaged()) << "held all the time";
  }
}

TEST_F(OmniFollowTest, AnEngagementThatIsNotAnsweredEnds) {
  start(true);
  robot_->can_follow = false;
  run(1.5);
  for (int i = 0; i < 3; ++i) {
    press(true, 1);
    EXPECT_FALSE(is_engaged());
    EXPECT_EQ(state(), ProcessState::kDegraded);
    press(false, 0.2);
    EXPECT_EQ(state(), ProcessState::kDegraded);
  }
  robot_->can_follow = true;
  press(true, 1);
  EXPECT_TRUE(is_engaged());
  EXPECT_EQ(state(), ProcessState::kOk);
}

TEST_F(OmniFollowTest, ANormalEngagementSurvivesALongRoundTrip) {
  start(true);
  robot_->delay = seconds(1.2);
  run(4);
  press(true, 20);
  EXPECT_TRUE(is_engaged());
  EXPECT_EQ(state(), ProcessState::kOk);
  for (int i = 0; i < 10; ++i) {  // quick presses: answers of the last ones are on their way
    press(false, 0.3);
    press(true, 0.5);
    EXPECT_TRUE(is_engaged()) << i;
  }
  run(5);
  EXPECT_TRUE(is_engaged());
}

TEST_F(OmniFollowTest, DoesNotEngageWithoutKnowingWhereTheArmIs) {
  reading_ = deflections({0, 0, 0, 0, 0});
  params_.device = DeviceKind::kGamepad;
  start(true);
  robot_->says_joints = false;
  robot_->position_rad = {0.6, -0.25, 0, 2};
  run(2);
  press(true, 2);
  EXPECT_FALSE(is_engaged());
  expect_degraded("cannot engage: no JOINT_STATE");
  EXPECT_EQ(robot_->position_rad[0], 0.6);
}

TEST_F(OmniFollowTest, AScriptWaitsUntilItMayEngageAndPressesAgain) {
  start(false);
  robot_->says_joints = false;
  run(5);
  for (const auto& c : commands_) EXPECT_FALSE(c.engaged);
  robot_->says_joints = true;
  run(0.2);
  EXPECT_TRUE(is_engaged());
  robot_->set_state(controller_state_t::STATE_IDLE, "E-STOP");
  run(5);
  EXPECT_FALSE(is_engaged());
  robot_->be_ready();
  run(0.9);
  EXPECT_FALSE(is_engaged());
  run(0.3);
  EXPECT_TRUE(is_engaged());
}

TEST_F(OmniFollowTest, NamesAnArmOfAnotherJointCount) {
  for (const size_t joints : {3u, 7u, 9u}) {
    start(true);
    robot_->position_rad.assign(joints, 0.1);
    run(1);
    expect_degraded("the robot's arm has " + std::to_string(joints) + " joints");
    press(true, 1);
    EXPECT_FALSE(is_engaged());
    for (const PortRecord& port : world_->node("omni").ports()) {
      if (port.spec.channel == "JOINT_STATE") {
        EXPECT_GT(port.rejected, 50);
      }
    }
  }
}

TEST_F(OmniFollowTest, SaysThatTheControllerIsSlowerThanItsCommands) {
  start(true);
  run(1);
  EXPECT_EQ(state(), ProcessState::kOk);
  robot_->velocity_limit_rad_per_s = 0.15;
  run(0.3);
  expect_degraded("above the limit of the arm's controller, 0.15");
}

TEST_F(OmniFollowTest, SaysThatTheRobotsClockDiffers) {
  for (const double ahead_s : {3.0, -3.0}) {
    start(true);
    robot_->clock_ahead = seconds(ahead_s);
    run(3);
    expect_degraded(ahead_s > 0 ? "the robot's clock is 3000 ms ahead"
                                : "the robot's clock is 3000 ms behind");
  }
}

}  // namespace
}  // namespace foresight
