// The simulated robot without a bus or a clock: arm, safety board, moving base, in ticks of 2 ms.
//
//   Robot robot(arm, params, start);
//   robot.tick();
//   robot.read_encoders(counts);                        // → the controller
//   robot.take_torques(reading, torque_nm);             // ← its answer; acts from now on
//   Pose<World, Cam> seen_from = robot.truth_at(exposure).world_from_cam;
//
// Until the first torques that are not zero a stand carries the arm at home. World is where the
// base begins. Same parameters, torques and buttons: same motion, bit by bit.
#pragma once

#include <cstdint>
#include <span>

#include "common/arm_model.h"
#include "common/frames.h"
#include "common/time.h"
#include "sim/arm/plant.h"
#include "sim/arm/safety_board.h"
#include "sim/arm/state_history.h"
#include "sim/base/base_script.h"

namespace foresight::sim {

constexpr Duration kTick = milliseconds(2);

struct RobotParams {
  PlantParams plant;
  BaseScript::Params base;
  SafetyMode start_mode = SafetyMode::kActive;
  Duration heartbeat = milliseconds(100);
};

/// What is really so at an instant.
struct RobotTruth {
  Pose<World, Base> world_from_base;
  Pose<World, Cam> world_from_cam;
  ArmState arm;
};

class Robot {
 public:
  Robot(const ArmModel& arm, const RobotParams& params, Time start);

  /// One tick later.
  void tick();
  /// Time passes and nothing moves (a machine that cannot keep up).
  void pass_over(Duration gap);

  /// One torque per motor, in answer to the encoders of `reading`; no effect unless the safety
  /// board is ACTIVE. False, and ignored: there was no such reading, it is older than the
  /// heartbeat, or it or a later one is answered already. So who sends a torque out of the blue
  /// changes one tick.
  [[nodiscard]] bool take_torques(Time reading, const JointVector& motor_torque_nm);
  void press(int8_t pendant_button);

  Time now() const { return now_; }
  int joint_count() const { return plant_.dynamics().size(); }
  const SafetyBoard& board() const { return board_; }
  void read_encoders(std::span<int32_t> counts) const { plant_.read_encoders(counts); }
  /// `time` within the last half second.
  RobotTruth truth_at(Time time) const;

 private:
  MotorMode motor_mode() const;

  ArmPlant plant_;
  SafetyBoard board_;
  BaseScript base_;
  StateHistory history_;
  Duration heartbeat_;
  Time start_, now_;
  Time answered_;  // the newest reading that is
  JointVector motor_torque_nm_;
  bool is_on_stand_ = true;
};

}  // namespace foresight::sim
