// The controller in closed loop with a plant, on a simulated clock: the test plays the arm's motor
// controllers, its safety board, and the operator.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "common/simulation.h"
#include "foresight/arm_encoders_t.hpp"
#include "foresight/arm_torques_t.hpp"
#include "foresight/controller_state_t.hpp"
#include "foresight/health_t.hpp"
#include "foresight/joint_command_t.hpp"
#include "foresight/joint_state_t.hpp"
#include "procs/wam_controller/process.h"
#include "procs/wam_controller/transmission.h"
#include "tests/wam_controller/joints.h"
#include "tests/wam_controller/plant.h"

namespace foresight {

class Rig {
 public:
  explicit Rig(const WamControllerParams& params);

  /// Encoders every 2 ms, from now on.
  void start_arm();
  void run(Duration duration) { world.run_until(world.now() + duration); }
  /// Sends commands at 30 Hz for a while; `target` gives each one's positions.
  void command_for(Duration duration, const std::function<JointVector(int)>& target);
  void command_for(Duration duration, const JointVector& target) {
    command_for(duration, [target](int) { return target; });
  }
  /// The button is let go: what is commanded next is a fresh engage.
  void let_go() { send(make_command(JointVector(0), false)); }
  /// The next command of the session, as it would be sent now.
  joint_command_t make_command(const JointVector& target, bool engaged = true);
  void send(const joint_command_t& message);
  void send_encoders(arm_encoders_t message);
  arm_encoders_t make_encoders() const;

  const controller_state_t& state() const { return states.back(); }
  ArmState does() const { return static_cast<ArmState>(states.back().state); }
  bool was_in(ArmState wanted) const;
  const health_t& health() const { return healths.back(); }
  double metric(const std::string& name) const;
  double largest_torque_nm() const;
  const JointVector& measured() const { return plant.position; }

  static WamControllerParams params_of(const std::string& arm);

  /// The process dies and another one starts.
  void restart();

  Simulation world{Time{1'000'000'000}};
  const ArmModel arm;
  Plant plant;
  // What the safety board says, and what the encoders lie.
  int8_t safety = arm_encoders_t::SAFETY_ACTIVE;
  std::string fault;
  int32_t counts_added = 0;    // to the first motor
  JointVector home_error_rad;  // the joints are not where their counts say
  bool is_blocked = false, is_silent = false;

  std::vector<controller_state_t> states;
  std::vector<health_t> healths;
  std::vector<joint_state_t> joint_states;
  std::vector<arm_torques_t> torques;
  int64_t session, seq = 0;

 private:
  void tick();
  void add_process();
  WamControllerParams params_;
  Transmission transmission_;
};

}  // namespace foresight
