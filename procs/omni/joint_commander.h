// From readings of the operator's device to joint commands that may be followed at once: mapping,
// clutch without a jump, bounded velocity, the arm's limits.
//
//   JointCommander commander(arm, paper_mapping(), {});
//   commander.set_measured(now, joint_state_rad);   // when known; delayed is good enough
//   commander.update(now, reading, clutch_is_on);
//   publish(commander.is_engaged(), commander.position_rad());
//
// Engaging. The first command is, in this order: the last command, when the clutch was let go less
// than a second ago (what is measured is older than what the arm still does); where the arm is
// measured to be, when that is at most a second old; the last command; where the mapping says
// (absolute mode) or the arm's home. So the arm never jumps.
// From there, position axes in
//   absolute mode: follow the mapping plus an offset that made the first command fit and that fades
//     with the align velocity, until the arm is where the device points;
//   relative mode: follow with that offset for good; at a joint limit the offset gives way, so that
//     turning back moves the joint at once.
// Deflections are integrated from the first command on.
// Every engaged command but the first lies within max velocity × time of the one before, and all
// lie inside the joint limits by the margin. O(joints), nothing throws.
#pragma once

#include <string>

#include "common/arm_model.h"
#include "common/time.h"
#include "procs/omni/input_device.h"
#include "procs/omni/joint_mapping.h"

namespace foresight {

enum class MotionMode : uint8_t { kAbsolute, kRelative };

struct CommanderOptions {
  MotionMode mode = MotionMode::kAbsolute;
  double max_velocity_rad_per_s = 1;       // of a command
  double align_velocity_rad_per_s = 0.25;  // at which an offset fades
  double axis_velocity_rad_per_s = 0.4;    // at full deflection
  double limit_margin_rad = 0.05;
};

class JointCommander {
 public:
  JointCommander(const ArmModel& arm, const JointMapping& mapping, const CommanderOptions& options);

  /// Where the arm is measured to be. False, and nothing happens, unless it has the arm's joints.
  [[nodiscard]] bool set_measured(Time arrival, const JointVector& position_rad);
  /// A reading and whether the clutch is on. `now` never goes back.
  void update(Time now, const DeviceReading& reading, bool engage);

  bool is_engaged() const { return engaged_; }
  /// The command; while not engaged the last one, before the first the arm's home.
  const JointVector& position_rad() const { return command_rad_; }
  /// The operator asks for more than the joint limits allow.
  bool is_limited() const { return limited_; }
  /// Why a reading cannot be used; else empty.
  const std::string& problem() const { return problem_; }

 private:
  bool is_usable(const DeviceReading& reading);
  void begin(Time now, const DeviceReading& reading);
  JointVector first_command(Time now, const DeviceReading& reading) const;
  JointVector wish(const DeviceReading& reading, double step_s);
  void limit(const JointVector& wish_rad);

  ArmModel arm_;
  JointMapping mapping_;
  CommanderOptions options_;
  JointVector command_rad_;
  JointVector wish_rad_;    // inside the limits; the command may still be on its way there
  JointVector offset_rad_;  // of position axes: wish − mapping
  JointVector measured_rad_;
  Time measured_at_, released_at_, updated_at_;
  bool has_measured_ = false, has_commanded_ = false, has_updated_ = false;
  bool engaged_ = false, limited_ = false;
  std::string problem_;
};

}  // namespace foresight
