// The process on a simulated clock.
#include <gtest/gtest.h>

#include "common/errors.h"
#include "common/message_check.h"
#include "common/simulation.h"
#include "procs/omni/process.h"
#include "tests/common/files.h"
#include "tests/omni/arms.h"

namespace foresight {
namespace {

constexpr Time kStart{5'000'000};

// A device that says what the test wants.
class PuppetDevice : public InputDevice {
 public:
  explicit PuppetDevice(const DeviceReading* reading) : reading_(reading) {}
  void open() override {}
  DeviceReading read(Time) override { return *reading_; }

 private:
  const DeviceReading* reading_;
};

class OmniProcessTest : public testing::Test {
 protected:
  OmniProcessTest() { params_.arm_file = deploy_file("arms/wam4.yaml"); }

  void start(bool puppet) {
    world_ = std::make_unique<Simulation>(kStart);
    world_->listen(Domain::kOperator, "JOINT_COMMAND",
                   [this](auto bytes) { take(bytes, commands_); });
    world_->listen(Domain::kOperator, "DEVICE_STATE", [this](auto bytes) { take(bytes, states_); });
    world_->add("omni", health_domains(OmniProcess::kInfo), [&](Node& node) {
      if (!puppet) return std::make_unique<OmniProcess>(node, params_);
      return std::make_unique<OmniProcess>(
          node, params_, [this](const OmniParams&, const ArmModel&, const JointMapping&) {
            return std::make_unique<PuppetDevice>(&reading_);
          });
    });
  }
  template <class Message>
  void take(std::span<const uint8_t> bytes, std::vector<Message>& into) {
    const MessageSchema* schema = find_schema(Message::getTypeName());
    ASSERT_EQ(find_layout_error(*schema, bytes), "");
    Message message;
    ASSERT_GT(message.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
    into.push_back(message);
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  void run(double span_s) { world_->run_until(world_->now() + seconds(span_s)); }
  void say_where_the_arm_is(const std::vector<double>& position_rad) {
    joint_state_t state{};
    state.utime = world_->now().us;
    state.n_joints = static_cast<int32_t>(position_rad.size());
    state.position_rad = state.velocity_rad_per_s = state.reference_position_rad =
        state.reference_velocity_rad_per_s = state.target_position_rad = position_rad;
    world_->inject(world_->now(), Domain::kOperator, "JOINT_STATE", encode(state));
  }
  ProcessState state() { return world_->node("omni").state(); }

  TemporaryFolder folder_;
  OmniParams params_;
  DeviceReading reading_ = positions({0, 0.7, 0});
  std::unique_ptr<Simulation> world_;
  std::vector<joint_command_t> commands_;
  std::vector<device_state_t> states_;
  std::vector<uint8_t> bytes_;
};

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

TEST_F(OmniProcessTest, BeginsWhereTheArmIsWhenItIsToldSo) {
  start(true);
  reading_.engaged = false;
  run(0.5);
  say_where_the_arm_is({0.3, -0.1, 0.05, 2});
  reading_.engaged = true;
  run(0.034);
  EXPECT_TRUE(commands_.back().engaged);
  EXPECT_EQ(commands_.back().position_rad, (std::vector{0.3, -0.1, 0.05, 2.0}));
}

TEST_F(OmniProcessTest, RefusesTheStateOfAnotherArm) {
  start(true);
  reading_.engaged = false;
  run(0.5);
  say_where_the_arm_is({0.3, -0.1, 0.05});
  say_where_the_arm_is(std::vector<double>(9, 0.1));
  run(1);
  for (const PortRecord& port : world_->node("omni").ports()) {
    if (port.spec.channel == "JOINT_STATE") {
      EXPECT_EQ(port.rejected, 2);
    }
  }
}

TEST_F(OmniProcessTest, SaysThatTheDeviceHasGoneAndWaitsForARelease) {
  start(true);
  run(0.5);
  EXPECT_TRUE(commands_.back().engaged);
  reading_.connected = false;
  reading_.engaged = false;
  reading_.problem = "unplugged";
  run(0.5);
  EXPECT_FALSE(commands_.back().engaged);
  EXPECT_FALSE(states_.back().connected);
  EXPECT_EQ(states_.back().n_joints, 3) << "the last reading";
  EXPECT_EQ(state(), ProcessState::kWaiting);
  reading_ = positions({0, 0.7, 0});
  run(0.5);
  EXPECT_TRUE(states_.back().engaged);
  EXPECT_FALSE(commands_.back().engaged) << "its button was held when it came back";
  EXPECT_EQ(state(), ProcessState::kOk);
  reading_.engaged = false;
  run(0.1);
  reading_.engaged = true;
  run(0.1);
  EXPECT_TRUE(commands_.back().engaged);
}

TEST_F(OmniProcessTest, TogglesWhenToldSo) {
  params_.clutch = "toggle";
  start(true);
  run(0.5);
  EXPECT_TRUE(commands_.back().engaged);
  reading_.engaged = false;
  run(0.5);
  EXPECT_TRUE(commands_.back().engaged);
  reading_.engaged = true;
  run(0.5);
  EXPECT_FALSE(commands_.back().engaged);
}

TEST_F(OmniProcessTest, AskedToQuitItReleasesAndEnds) {
  start(true);
  run(0.5);
  reading_.quit = true;
  run(0.034);
  EXPECT_FALSE(commands_.back().engaged);
  EXPECT_TRUE(world_->is_stopped());
}

TEST_F(OmniProcessTest, PublishesDeflectionsAsNoJoints) {
  reading_ = deflections({1, 0, 0, 0, 0});
  reading_.buttons = {0, 1};
  params_.device = "gamepad";
  start(true);
  run(0.5);
  EXPECT_EQ(states_.back().n_joints, 0);
  EXPECT_EQ(states_.back().buttons, (std::vector<int8_t>{0, 1}));
  EXPECT_LT(commands_.back().position_rad[0], -0.1);
}

TEST_F(OmniProcessTest, PlaysWaypointsInJointsOfTheArm) {
  params_.device = "waypoints";
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
