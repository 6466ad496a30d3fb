// The operator's hand in the loop: a device, omni, the link, the arm's controller and the simulated
// arm, without cameras. The button is held and the stick deflected through whatever happens; the
// arm must not move again before the button was let go and pressed.
#include <gtest/gtest.h>

#include <functional>

#include "common/simulation.h"
#include "foresight/controller_state_t.hpp"
#include "foresight/joint_command_t.hpp"
#include "foresight/pendant_t.hpp"
#include "foresight/truth_t.hpp"
#include "procs/link/process.h"
#include "procs/omni/process.h"
#include "procs/wam_controller/process.h"
#include "sim/robot/process.h"

namespace foresight {
namespace {

constexpr double kDelay_s = 0.3;  // each way

class HeldStick : public InputDevice {
 public:
  HeldStick(const bool* is_pressed, double deflection)
      : is_pressed_(*is_pressed), deflection_(deflection) {}
  void open() override {}
  DeviceReading read(Time) override {
    return {.connected = true,
            .engaged = is_pressed_,
            .kind = AxisKind::kVelocity,
            .axes = {deflection_, 0, 0, 0, 0}};
  }

 private:
  const bool& is_pressed_;
  double deflection_;
};

class OperatorLoop {
 public:
  OperatorLoop() {
    arm_.camera_rate_hz = 0;
    link_.to_operator.delay_s = link_.to_robot.delay_s = kDelay_s;
    for (const auto& [name, add] : adders_) add();
    world_.listen(Domain::kRobot, "TRUTH_STATE", [this](auto bytes) {
      joint_rad_ = decode_checked<truth_t>(bytes)->joint_position_rad[0];
    });
    world_.listen(Domain::kRobot, "CONTROLLER_STATE", [this](auto bytes) {
      controller_ = decode_checked<controller_state_t>(bytes)->state;
    });
    world_.listen(Domain::kOperator, "JOINT_COMMAND",
                  [this](auto bytes) { command_ = *decode_checked<joint_command_t>(bytes); });
  }
  void run(double span_s) { world_.run_until(world_.now() + seconds(span_s)); }
  void hold(bool is_pressed, double span_s) {
    is_pressed_ = is_pressed;
    run(span_s);
  }
  void press_pendant(int8_t button, double then_s) {
    pendant_t message{};
    message.utime = world_.now().us;
    message.button = button;
    world_.inject(world_.now(), Domain::kRobot, "PENDANT", encode(message));
    run(then_s);
  }
  /// Somebody else sits down at the operator's site; his stick turns the joint the other way.
  void add_second_operator() { add_omni("omni_2", &is_second_pressed_, 1); }
  void hold_second(bool is_pressed, double span_s) {
    is_second_pressed_ = is_pressed;
    run(span_s);
  }
  void kill(const std::string& name) { world_.remove(name); }
  void start(const std::string& name) { adders_.at(name)(); }
  double joint_rad() const { return joint_rad_; }
  bool is_following() const { return controller_ == controller_state_t::STATE_FOLLOWING; }
  const joint_command_t& command() const { return command_; }
  ProcessState health(const std::string& name) const { return world_.node(name).state(); }

 private:
  template <class P>
  void add(const typename P::Params& params) {
    world_.add(P::kInfo.name, health_domains(P::kInfo),
               [&](Node& node) { return std::make_unique<P>(node, params); });
  }
  void add_omni(const std::string& name, const bool* is_pressed, double deflection) {
    world_.add(name, health_domains(OmniProcess::kInfo), [=](Node& node) {
      const auto make = [=](const OmniParams&, const ArmModel&, const JointMapping&) {
        return std::make_unique<HeldStick>(is_pressed, deflection);
      };
      OmniParams params;
      params.device = DeviceKind::kGamepad;
      return std::make_unique<OmniProcess>(node, params, make);
    });
  }

  Simulation world_{Time{1'000'000'000'000}};
  sim::SimParams arm_;
  LinkParams link_;
  bool is_pressed_ = false, is_second_pressed_ = false;
  double joint_rad_ = 0;
  int8_t controller_ = -1;
  joint_command_t command_{};
  std::map<std::string, std::function<void()>> adders_{
      {"link", [this] { add<LinkProcess>(link_); }},
      {"omni", [this] { add_omni("omni", &is_pressed_, -1); }},
      {"sim", [this] { add<sim::SimProcess>(arm_); }},
      {"wam_controller", [this] { add<WamControllerProcess>({}); }}};
};

// What happens to the robot while it follows, up to where it could be driven again.
struct Incident {
  const char* name;
  void (*happen)(OperatorLoop&);
};

void emergency_stop(OperatorLoop& loop) {
  loop.press_pendant(pendant_t::BUTTON_ESTOP, 4);
  loop.press_pendant(pendant_t::BUTTON_IDLE, 1);
  loop.press_pendant(pendant_t::BUTTON_ACTIVATE, 0.1);
}
void shift_idle(OperatorLoop& loop) {
  loop.press_pendant(pendant_t::BUTTON_IDLE, 4);
  loop.press_pendant(pendant_t::BUTTON_ACTIVATE, 0.1);
}
void quick_shift_idle(OperatorLoop& loop) {
  loop.press_pendant(pendant_t::BUTTON_IDLE, 0.1);
  loop.press_pendant(pendant_t::BUTTON_ACTIVATE, 0.1);
}
void controller_dies(OperatorLoop& loop) {
  loop.kill("wam_controller");
  loop.run(0.05);
  loop.start("wam_controller");
  loop.run(0.5);
}
void link_dies(OperatorLoop& loop) {
  loop.kill("link");
  loop.run(3);
  loop.start("link");
  loop.run(1);
}
void omni_dies(OperatorLoop& loop) {
  loop.kill("omni");
  loop.run(2);
  loop.start("omni");
}

class AfterAnIncident : public testing::TestWithParam<Incident> {};

TEST_P(AfterAnIncident, NothingMovesBeforeAFreshPress) {
  OperatorLoop loop;
  loop.run(2);
  loop.hold(true, 2);
  ASSERT_TRUE(loop.is_following());
  ASSERT_GT(loop.joint_rad(), 0.3);
  GetParam().happen(loop);
  loop.run(2 * kDelay_s + 1);  // what was under way when it happened, and its end
  const double rest_rad = loop.joint_rad();
  loop.run(4);
  EXPECT_NEAR(loop.joint_rad(), rest_rad, 0.01) << "the button is held all the time";
  EXPECT_EQ(loop.command().engaged, 0);
  EXPECT_NEAR(loop.command().position_rad[0], rest_rad, 0.01) << "the measured arm";
  EXPECT_EQ(loop.health("omni"), ProcessState::kDegraded);
  loop.hold(false, 0.5);
  loop.hold(true, 2);
  EXPECT_TRUE(loop.is_following());
  EXPECT_GT(loop.joint_rad(), rest_rad + 0.3);
  EXPECT_LT(loop.joint_rad(), rest_rad + 0.8) << "from where it was";
  EXPECT_EQ(loop.health("omni"), ProcessState::kOk);
}

INSTANTIATE_TEST_SUITE_P(Incidents, AfterAnIncident,
                         testing::Values(Incident{"EmergencyStop", emergency_stop},
                                         Incident{"ShiftIdle", shift_idle},
                                         Incident{"QuickShiftIdle", quick_shift_idle},
                                         Incident{"ControllerDies", controller_dies},
                                         Incident{"LinkDies", link_dies},
                                         Incident{"OmniDies", omni_dies}),
                         [](const auto& param_info) { return std::string(param_info.param.name); });

// Who presses first drives until he lets go; whoever waited presses anew. Both are told.
TEST(TwoOperators, OneDrivesAndTheOtherIsTold) {
  OperatorLoop loop;
  loop.run(2);
  EXPECT_EQ(loop.health("omni"), ProcessState::kOk);
  loop.add_second_operator();
  loop.run(1);
  loop.hold(true, 2);
  ASSERT_TRUE(loop.is_following());
  const double first_rad = loop.joint_rad();
  loop.hold_second(true, 1);
  EXPECT_GT(loop.joint_rad(), first_rad + 0.2) << "the first one's direction";
  EXPECT_EQ(loop.health("omni"), ProcessState::kDegraded);
  EXPECT_EQ(loop.health("omni_2"), ProcessState::kDegraded);
  loop.hold(false, 2 * kDelay_s + 1);
  const double rest_rad = loop.joint_rad();
  loop.run(2);
  EXPECT_NEAR(loop.joint_rad(), rest_rad, 0.01) << "the second one has held since";
  loop.hold_second(false, 0.5);
  loop.hold_second(true, 2);
  EXPECT_TRUE(loop.is_following());
  EXPECT_LT(loop.joint_rad(), rest_rad - 0.3);
}

}  // namespace
}  // namespace foresight
