// From readings of the operator's device to joint commands that may be followed at once: mapping,
// clutch without a jump, bounded velocity, the arm's limits.
//
//   JointCommander commander(arm, paper_mapping(), {});
//   commander.set_measured(now, joint_state_rad);   // delayed is good enough
//   commander.update(now, reading, clutch_is_on);
//   publish(commander.is_engaged(), commander.position_rad());
//
// Engaging needs to know where the arm is: without a measurement of the last second nothing is
// engaged. The first command is the last one, when the clutch was let go so recently that what is
// measured is older than what the arm still does (a second for its stop, and the round trip of
// messages); else where the arm is measured to be. So the arm never jumps.
// While not engaged, the command is held until then and is the measured arm from there on; of an
// arm that does not follow (stand_down()) it is the measured arm at once.
// From there, position axes in
//   absolute mode: follow the mapping plus an offset that made the first command fit and that fades
//     with the align velocity, until the arm is where the device points;
//   relative mode: follow with that offset for good; at a joint limit the offset gives way, so that
//     turning back moves the joint at once.
// Deflections are integrated from the first command on, at what the velocity allows: nothing is
// left to be made up for when the stick is back at rest. Every engaged command but the first lies
// within max velocity × time of the one before, and all lie inside the joint limits by the margin.
// O(joints), nothing throws.
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
  /// How long a message takes to the arm and back.
  void set_round_trip(Duration round_trip);
  /// The arm is not faster, whatever the options say; 0: not known. So no command runs ahead of it.
  void set_velocity_limit(double limit_rad_per_s);
  /// The arm does not follow: the last command means nothing any more.
  void stand_down();
  /// A reading and whether the clutch is on. `now` never goes back.
  void update(Time now, const DeviceReading& reading, bool engage);

  bool is_engaged() const { return engaged_; }
  /// The command; before the first measurement the arm's home.
  const JointVector& position_rad() const { return command_rad_; }
  /// The operator asks for more than the joint limits allow.
  bool is_limited() const { return limited_; }
  /// One line when the arm is slower than the options allow; else empty.
  std::string slowness() const;
  /// Why a reading cannot be used, or nothing be engaged; else empty.
  const std::string& problem() const { return problem_; }

 private:
  bool is_usable(const DeviceReading& reading);
  void begin(const DeviceReading& reading);
  bool knows_arm(Time now) const;
  void rest(Time now);
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
  Duration round_trip_{0};
  double velocity_rad_per_s_;  // the lower one of ours and the arm's
  bool has_measured_ = false, has_updated_ = false;
  bool is_settling_ = false;  // the arm is still on its way to what was commanded last
  bool engaged_ = false, limited_ = false;
  std::string problem_;
};

}  // namespace foresight
