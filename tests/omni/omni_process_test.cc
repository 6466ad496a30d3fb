// The process on a simulated clock.
#include "tests/omni/omni_fixture.h"

namespace foresight {
namespace {

TEST_F(OmniProcessTest, PublishesAtItsRateInOneSessionInOrder) {
  start(false);
  run(10);
  ASSERT_NEAR(static_cast<double>(commands_.size()), 300, 1);
  ASSERT_EQ(states_.size(), commands_.size());
  for (size_t i = 0; i < commands_.size(); ++i) {
    const joint_command_t& c = commands_[i];
    EXPECT_EQ(c.session, kStart.us);
    EXPECT_EQ(c.seq, static_cast<int64_t>(i) + 1);
    EXPECT_EQ(c.n_joints, 4);
    EXPECT_EQ(c.utime, states_[i].utime);
    EXPECT_EQ(states_[i].device, "script");
    EXPECT_EQ(states_[i].n_joints, 6);
    if (i > 0) {
      EXPECT_NEAR(static_cast<double>(c.utime - commands_[i - 1].utime), 33'333, 1);
    }
  }
  EXPECT_EQ(state(), ProcessState::kOk);
}

TEST_F(OmniProcessTest, TheScriptStartsFromHomeAfterItsDelay) {
  params_.start_delay_s = 2;
  start(false);
  run(1.9);
  for (const auto& c : commands_) EXPECT_FALSE(c.engaged);
  run(0.3);
  EXPECT_TRUE(commands_.back().engaged);
  const std::vector<double> home{0, -0.25, 0, 2.25};
  for (size_t i = 0; i < 4; ++i) EXPECT_NEAR(commands_.back().position_rad[i], home[i], 0.01);
}

TEST_F(OmniProcessTest, CommandsStayBelowTheVelocityAndInsideTheLimits) {
  start(false);
  run(120);
  const ArmModel arm = wam4();
  for (size_t i = 1; i < commands_.size(); ++i) {
    for (size_t j = 0; j < 4; ++j) {
      const double at_rad = commands_[i].position_rad[j];
      ASSERT_GE(at_rad, arm.joints[j].lower_rad + params_.commander.limit_margin_rad - 1e-9);
      ASSERT_LE(at_rad, arm.joints[j].upper_rad - params_.commander.limit_margin_rad + 1e-9);
      ASSERT_LE(std::abs(at_rad - commands_[i - 1].position_rad[j]) * 30, 0.5);
    }
  }
}

TEST_F(OmniProcessTest, TheSameSeedGivesTheSameBytes) {
  start(false);
  run(60);
  const std::vector<uint8_t> first = std::move(bytes_);
  bytes_.clear();
  start(false);
  run(60);
  EXPECT_EQ(bytes_, first);
  bytes_.clear();
  params_.script.seed = 2;
  start(false);
  run(60);
  EXPECT_NE(bytes_, first);
}

TEST_F(OmniProcessTest, BeginsWhereTheArmIs) {
  start(true);
  run(1);
  robot_->position_rad = {0.3, -0.1, 0.05, 2};
  run(0.5);
  press(true, 0.034);
  EXPECT_TRUE(is_engaged());
  EXPECT_EQ(commands_.back().position_rad, (std::vector{0.3, -0.1, 0.05, 2.0}));
}

TEST_F(OmniProcessTest, SaysThatTheDeviceHasGoneAndWaitsForARelease) {
  start(true);
  run(0.5);
  press(true, 0.5);
  EXPECT_TRUE(is_engaged());
  reading_.connected = false;
  reading_.engaged = false;
  reading_.problem = "unplugged";
  run(0.5);
  EXPECT_FALSE(is_engaged());
  EXPECT_FALSE(states_.back().connected);
  EXPECT_EQ(states_.back().n_joints, 3) << "the last reading";
  EXPECT_EQ(state(), ProcessState::kWaiting);
  reading_ = positions({0, 0.7, 0});
  run(0.5);
  EXPECT_TRUE(states_.back().engaged);
  EXPECT_FALSE(is_engaged()) << "its button was held when it came back";
  expect_degraded("let go of the clutch and press it again (unplugged)");
  press(false, 0.1);
  EXPECT_EQ(state(), ProcessState::kOk);
  press(true, 0.1);
  EXPECT_TRUE(is_engaged());
}

TEST_F(OmniProcessTest, TogglesWhenToldSo) {
  params_.clutch = ClutchMode::kToggle;
  start(true);
  run(0.5);
  press(true, 0.5);
  EXPECT_TRUE(is_engaged());
  press(false, 0.5);
  EXPECT_TRUE(is_engaged());
  press(true, 0.5);
  EXPECT_FALSE(is_engaged());
}

TEST_F(OmniProcessTest, AskedToQuitItReleasesAndEnds) {
  start(true);
  run(0.5);
  press(true, 0.5);
  EXPECT_TRUE(is_engaged());
  reading_.quit = true;
  run(0.034);
  EXPECT_FALSE(is_engaged());
  EXPECT_TRUE(world_->is_stopped());
}

// Killed and started anew while the operator holds the button.
// E-STOP, shift-idle, a fault, missing encoders: whatever ends the following. The button is held
// and the stick deflected all the time.
// The link stands still: what the hand does meanwhile must not wait in the command.
// Dropped on their way, or refused for their stamps: commands that move nothing are never OK.
// Sticks at rest would drive the arm home.
TEST_F(OmniProcessTest, ASilentDeviceIsLetGoUntilItsButtonWas) {
  start_with_sticks({-1, 0, 0, 0, 0});
  reading_.silent = true;
  reading_.problem = "says nothing";
  run(0.1);
  EXPECT_FALSE(is_engaged());
  expect_degraded("says nothing");
  reading_.silent = false;
  reading_.problem = "";
  run(1);
  EXPECT_FALSE(is_engaged()) << "the button is held still";
  press(false, 0.1);
  press(true, 0.1);
  EXPECT_TRUE(is_engaged());
}

// The clocks of the sites differ, both ways.
TEST_F(OmniProcessTest, PublishesDeflectionsAsNoJoints) {
  start_with_sticks({1, 0, 0.5, 0, 0});
  reading_.buttons = {0, 1};
  run(0.5);
  EXPECT_EQ(states_.back().n_joints, 0);
  EXPECT_EQ(states_.back().deflections, (std::vector<double>{1, 0, 0.5, 0, 0}));
  EXPECT_EQ(states_.back().buttons, (std::vector<int8_t>{0, 1}));
  EXPECT_LT(commands_.back().position_rad[0], -0.1);
}

TEST_F(OmniProcessTest, PlaysWaypointsInJointsOfTheArm) {
  params_.device = DeviceKind::kWaypoints;
  params_.device_path =
      folder_.write("way.csv", "time_s,j1,j2,j3,j4\n0,0,-0.25,0,2.25\n3,0.5,-0.25,0,2\n");
  params_.mapping_file = deploy_file("mappings/direct.yaml");
  start(false);
  run(2.5);
  EXPECT_NEAR(commands_.back().position_rad[0], 0.25, 0.02);
  run(2);
  EXPECT_FALSE(commands_.back().engaged) << "at the end the clutch is let go";
  EXPECT_NEAR(commands_.back().position_rad[0], 0.5, 0.01);
  EXPECT_EQ(state(), ProcessState::kDone);
  EXPECT_FALSE(world_->is_stopped());
}

TEST_F(OmniProcessTest, DrivesSevenJoints) {
  params_.arm_file = deploy_file("arms/wam7.yaml");
  start(false);
  robot_->position_rad.assign(7, 0.2);
  run(5);
  EXPECT_EQ(commands_.back().n_joints, 7);
  EXPECT_TRUE(commands_.back().engaged);
}

TEST_F(OmniProcessTest, RefusesConfigurationsWithOneLine) {
  params_.arm_file = "nowhere.yaml";
  EXPECT_NE(error_of<ConfigError>([&] { start(false); }).find("nowhere.yaml"), std::string::npos);
  params_.arm_file = deploy_file("arms/wam4.yaml");
  params_.mapping_file = "nomapping.yaml";
  EXPECT_NE(error_of<ConfigError>([&] { start(false); }).find("nomapping"), std::string::npos);
}

}  // namespace
}  // namespace foresight
