// omni on a clock that the test sets: as before the first CLOCK of a simulated world, or by a
// person.
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <vector>

#include "common/message_check.h"
#include "procs/omni/process.h"
#include "tests/omni/arms.h"

namespace foresight {
namespace {

// Whatever is declared is kept; the test sets the time and makes things happen.
class ManualHost : public Host {
 public:
  Time time{1'000'000'000};
  joint_command_t command{};
  std::function<void()> tick;
  std::map<std::string, Handler> handlers;

  Time now() const override { return time; }
  bool is_simulated() const override { return true; }
  void publish(Domain, const std::string& channel, std::span<const uint8_t> bytes) override {
    if (channel == "JOINT_COMMAND") command = *decode_checked<joint_command_t>(bytes);
  }
  void subscribe(Domain, const std::string& channel, Queue, int64_t*, Handler handler) override {
    handlers[channel] = std::move(handler);
  }
  void call_every(Duration period, std::function<void()> call) override {
    if (period < seconds(1.0)) tick = std::move(call);
  }
  void call_at(Time, std::function<void()>) override {}
  void run_job(Job, Duration) override {}
  void stop(int) override {}
};

// For it, time never goes back: keys would be held for as long.
class HeldButton : public InputDevice {
 public:
  explicit HeldButton(const bool* is_pressed) : is_pressed_(*is_pressed) {}
  void open() override {}
  DeviceReading read(Time now) override {
    EXPECT_GE(now, last_);
    last_ = now;
    DeviceReading reading = deflections({-1, 0, 0, 0, 0});
    reading.engaged = is_pressed_;
    return reading;
  }

 private:
  const bool& is_pressed_;
  Time last_;
};

class OmniClockTest : public testing::Test {
 protected:
  OmniClockTest() {
    params_.arm_file = deploy_file("arms/wam4.yaml");
    params_.device = DeviceKind::kGamepad;
    omni_.emplace(node_, params_, [this](const OmniParams&, const ArmModel&, const JointMapping&) {
      return std::make_unique<HeldButton>(&is_pressed_);
    });
    omni_->start();
  }
  /// Time goes on, the robot speaks, the device is read.
  void run(double span_s) {
    for (double t = 0; t < span_s - 1e-9; t += 1.0 / 30) {
      host_.time = host_.time + microseconds(33'333);
      joint_state_t joints{};
      joints.utime = host_.time.us;
      joints.n_joints = 4;
      joints.position_rad = joints.velocity_rad_per_s = joints.reference_position_rad =
          joints.reference_velocity_rad_per_s = joints.target_position_rad = {0, 0, 0, 2};
      joints.command_utime = host_.command.utime;
      joints.command_arrival_utime = host_.command.utime;
      host_.handlers.at("JOINT_STATE")(encode(joints));
      controller_state_t state{};
      state.utime = host_.time.us;
      state.state = host_.command.engaged != 0 ? controller_state_t::STATE_FOLLOWING
                                               : controller_state_t::STATE_HOLDING;
      host_.handlers.at("CONTROLLER_STATE")(encode(state));
      host_.tick();
    }
  }
  void engage() {
    run(1.5);
    is_pressed_ = true;
    run(1);
    ASSERT_EQ(command().engaged, 1);
  }
  const joint_command_t& command() const { return host_.command; }

  ManualHost host_;
  OmniParams params_;
  Node node_{"omni", host_, {Domain::kOperator}};
  std::optional<OmniProcess> omni_;
  bool is_pressed_ = false;
};

// Killed while the simulated world lags behind the wall clock by 40 s: the controller refuses
// sessions from the future.
TEST_F(OmniClockTest, ItsSessionIsOfTheWorldsTime) {
  run(0.1);
  const int64_t by_wall = command().session;
  host_.time = host_.time - seconds(40.0);
  run(0.03);
  EXPECT_LT(command().session, by_wall);
  EXPECT_LE(command().session, command().utime);
  EXPECT_EQ(command().seq, 1);
  const int64_t session = command().session;
  run(1);
  EXPECT_EQ(command().session, session);
  EXPECT_GT(command().seq, 20);
}

TEST_F(OmniClockTest, AClockThatIsSetLetsGo) {
  for (const double step_s : {-3.0, 3.0, -0.5}) {
    is_pressed_ = false;
    engage();
    const int64_t session = command().session;
    host_.time = host_.time + seconds(step_s);
    run(0.03);
    if (step_s == -0.5) {
      EXPECT_EQ(command().engaged, 1) << "passes for jitter";
      continue;
    }
    EXPECT_EQ(command().engaged, 0);
    EXPECT_EQ(command().session == session, step_s > 0);
    run(3);
    EXPECT_EQ(command().engaged, 0) << "the button is held all the time";
  }
}

// Stopped for two seconds (SIGSTOP): the arm's controller has let go meanwhile.
TEST_F(OmniClockTest, AfterAPauseAFreshPressIsNeeded) {
  engage();
  host_.time = host_.time + seconds(2.0);
  run(3);
  EXPECT_EQ(command().engaged, 0);
  is_pressed_ = false;
  run(0.1);
  is_pressed_ = true;
  run(0.1);
  EXPECT_EQ(command().engaged, 1);
}

}  // namespace
}  // namespace foresight
