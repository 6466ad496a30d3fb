// A robot at the other end of a link, as the operator's site sees it: says where its arm is and
// what its controller does, follows commands at once, and does what the test says.
#pragma once

#include <string>
#include <vector>

#include "common/message_check.h"
#include "common/node.h"
#include "common/simulation.h"
#include "foresight/controller_state_t.hpp"
#include "foresight/joint_command_t.hpp"
#include "foresight/joint_state_t.hpp"

namespace foresight {

class RobotStandIn {
 public:
  std::vector<double> position_rad{0, -0.25, 0, 2.25};
  bool says_joints = true, says_state = true;
  bool hears = true;       // commands
  bool can_follow = true;  // an engaged command
  Duration delay{0};       // each way
  Duration clock_ahead{0};
  double velocity_limit_rad_per_s = 1;
  int64_t commands_of_others = 0;

  explicit RobotStandIn(Simulation* world) : world_(*world) {
    world_.listen(Domain::kOperator, "JOINT_COMMAND", [this](auto bytes) {
      const auto command = decode_checked<joint_command_t>(bytes);
      if (command) world_.call_at(world_.now() + delay, [this, c = *command] { take(c); });
    });
    on_timer();
  }
  /// Of a controller that is not active, whose driver is another, …
  void set_state(int8_t state, const std::string& reason, int64_t driver = 0,
                 bool needs_release = false) {
    state_ = state;
    reason_ = reason;
    driver_ = driver;
    needs_release_ = needs_release;
    say_state();
  }
  void be_ready() { set_state(controller_state_t::STATE_HOLDING, "waits for an engaged command"); }
  int8_t state() const { return state_; }

 private:
  int64_t stamp() const { return (world_.now() + clock_ahead).us; }
  void take(const joint_command_t& command) {
    if (!hears) return;
    command_utime_ = command.utime;
    command_arrival_utime_ = stamp();
    const bool is_active = state_ == controller_state_t::STATE_HOLDING ||
                           state_ == controller_state_t::STATE_FOLLOWING;
    if (!is_active || !can_follow || (driver_ != 0 && driver_ != command.session)) return;
    const int8_t before = state_;
    if (command.engaged != 0) position_rad = command.position_rad;
    state_ = command.engaged != 0 ? controller_state_t::STATE_FOLLOWING
                                  : controller_state_t::STATE_HOLDING;
    driver_ = command.engaged != 0 ? command.session : 0;
    if (state_ == before) return;
    reason_ = command.engaged != 0 ? "" : "the operator let go";
    say_state();
  }
  void on_timer() {
    say_joints();
    if (++count_ % 5 == 0) say_state();
    world_.call_at(world_.now() + milliseconds(20), [this] { on_timer(); });
  }
  void say_joints() {
    if (!says_joints) return;
    joint_state_t state{};
    state.utime = stamp();
    state.n_joints = static_cast<int32_t>(position_rad.size());
    state.position_rad = state.velocity_rad_per_s = state.reference_position_rad =
        state.reference_velocity_rad_per_s = state.target_position_rad = position_rad;
    state.command_utime = command_utime_;
    state.command_arrival_utime = command_arrival_utime_;
    world_.inject(world_.now() + delay, Domain::kOperator, "JOINT_STATE", encode(state));
  }
  void say_state() {
    if (!says_state) return;
    controller_state_t state{};
    state.utime = stamp();
    state.state = state_;
    state.reason = reason_;
    state.driver_session = driver_;
    state.needs_release = needs_release_ ? 1 : 0;
    state.velocity_limit_rad_per_s = velocity_limit_rad_per_s;
    state.commands_of_others = commands_of_others;
    world_.inject(world_.now() + delay, Domain::kOperator, "CONTROLLER_STATE", encode(state));
  }

  Simulation& world_;
  int8_t state_ = controller_state_t::STATE_HOLDING;
  std::string reason_ = "waits for an engaged command";
  int64_t driver_ = 0, command_utime_ = 0, command_arrival_utime_ = 0;
  bool needs_release_ = false;
  int count_ = 0;
};

}  // namespace foresight
