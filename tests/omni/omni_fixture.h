// The omni process on a simulated clock, with a robot at the other end.
#pragma once

#include <gtest/gtest.h>

#include "common/errors.h"
#include "common/message_check.h"
#include "common/simulation.h"
#include "procs/omni/process.h"
#include "tests/common/files.h"
#include "tests/omni/arms.h"
#include "tests/omni/robot_stand_in.h"

namespace foresight {

inline constexpr Time kStart{5'000'000};

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

  /// `puppet`: a device that says what the test wants, at first with its clutch let go.
  void start(bool puppet, bool with_robot = true) {
    world_ = std::make_unique<Simulation>(kStart);
    robot_ = with_robot ? std::make_unique<RobotStandIn>(world_.get()) : nullptr;
    reading_.engaged = false;
    world_->listen(Domain::kOperator, "JOINT_COMMAND",
                   [this](auto bytes) { take(bytes, commands_); });
    world_->listen(Domain::kOperator, "DEVICE_STATE", [this](auto bytes) { take(bytes, states_); });
    world_->listen(Domain::kOperator, "HEALTH",
                   [this](auto bytes) { reason_ = decode_checked<health_t>(bytes)->reason; });
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
  /// Presses the clutch, or lets it go, and lets time pass.
  void press(bool pressed, double span_s) {
    reading_.engaged = pressed;
    run(span_s);
  }
  /// Ready, then engaged with these sticks.
  void start_with_sticks(std::vector<double> axes) {
    params_.device = DeviceKind::kGamepad;
    reading_ = deflections(std::move(axes));
    start(true);
    run(1.5);
    press(true, 1);
    ASSERT_TRUE(is_engaged());
  }
  bool is_engaged() const { return commands_.back().engaged != 0; }
  double command_rad(size_t joint) const { return commands_.back().position_rad[joint]; }
  ProcessState state() { return world_->node("omni").state(); }
  /// The reason of the newest HEALTH that omni published.
  std::string reason() {
    run(1.05);
    return reason_;
  }
  void expect_degraded(const std::string& reason_has) {
    EXPECT_EQ(state(), ProcessState::kDegraded);
    EXPECT_NE(reason().find(reason_has), std::string::npos) << reason_;
  }

  TemporaryFolder folder_;
  OmniParams params_;
  DeviceReading reading_ = positions({0, 0.7, 0});
  std::unique_ptr<Simulation> world_;
  std::unique_ptr<RobotStandIn> robot_;
  std::string reason_;
  std::vector<joint_command_t> commands_;
  std::vector<device_state_t> states_;
  std::vector<uint8_t> bytes_;
};

}  // namespace foresight
