// The arm's controller without its surroundings: what it does at each encoder reading and at each
// command. The reference is one trapezoid per joint, re-fitted at every command from where it is
// (paper §II-D); the joints follow it by PID with gravity compensation and inertia feed-forward.
//
//   ArmController controller(arm, options);
//   controller.on_command(arrival, command);          // 30 Hz
//   hardware.write(controller.step(reading));          // 500 Hz
//
// The reference depends on the admitted commands and their arrival times alone, not on when steps
// happen, so that JointReference in another process repeats it. States and who changes them:
//
//   idle ──board ACTIVE──► holding ──fresh engage──► following ──time-out, let go──► stopping
//    ▲ board not ACTIVE,      ▲ reference at rest ◄───────────────────────────────────┘
//    └ no encoders            (a fresh engage leads from stopping to following, too)
//   any ──board's fault; encoder jump or large tracking error while active──► fault
//   fault ──board was IDLE and is ACTIVE again──► holding
//
// A fresh engage (command_gate.h): nobody drives, and the sender was seen let go since the arm
// became active and since its commands were last silent. So nothing that was pressed before a
// start, an E-STOP, a fault or a gap moves the arm after it: let go, and press again.
//
// While it holds at rest, what that takes is compared with the arm's weight in that posture. If
// they contradict each other for a second (a wrong home position, a load, somebody who leans on
// it), it goes on holding and follows nobody until they agree again.
//
// Torques are zero in idle and fault. on_command() and step() neither allocate nor throw.
#pragma once

#include "common/arm_model.h"
#include "common/joint_reference.h"
#include "common/robot_types.h"
#include "procs/wam_controller/arm_dynamics.h"
#include "procs/wam_controller/arm_hardware.h"
#include "procs/wam_controller/command_gate.h"
#include "procs/wam_controller/joint_servo.h"
#include "procs/wam_controller/weighing.h"

namespace foresight {

struct ControllerOptions {
  ControllerLimits limits;
  Duration command_max_age{2'000'000};  // older ones are dropped
  Duration encoder_timeout{100'000};    // without encoders for this long it is idle
  double encoder_jump_rad_per_s = 20;   // joints cannot be faster: the encoder has jumped
  double tracking_error_limit_rad = 0.15;
  double velocity_filter_hz = 100;
  bool inertia_feed_forward = true;
  Eigen::Vector3d gravity_in_base_m_per_s2{0, 0, -9.81};
  double weight_tolerance_nm = 3;  // of each joint, between what holding takes and its weight
  bool is_weighed_first = false;   // before it follows, after each activation
};

enum class ArmReason : uint8_t {
  kNone,
  kNoEncoders,
  kEstop,
  kNotActivated,
  kNoCommandYet,
  kCommandsEnded,
  kLetGo,
  kNeedsRelease,
  kIsWeighed,
  kWeight,
  kEncoderJump,
  kTrackingError,
  kSafetyFault,
  kNoNumber,
};
/// For people; names no joint.
const char* to_string(ArmReason reason);

struct ArmStatus {
  ArmState state = ArmState::kIdle;
  ArmReason reason = ArmReason::kNoEncoders;
  int joint = -1;  // that the reason is about, from 0; −1: none
  bool operator==(const ArmStatus&) const = default;
};

class ArmController {
 public:
  ArmController(const ArmModel& arm, const ControllerOptions& options);

  /// `arrival`: on the clock that stamps the readings.
  CommandVerdict on_command(Time arrival, const JointCommand& command);
  /// The joint torques that answer a reading. Zero unless the arm is active.
  const JointVector& step(const ArmReading& reading);
  /// To be called now and then in case that readings stop coming.
  void on_time(Time now);

  const ArmStatus& status() const { return status_; }
  /// Who drives, and what became of the commands.
  const CommandGate& gate() const { return gate_; }
  const ControllerLimits& limits() const { return options_.limits; }
  int64_t commands_limited() const { return commands_limited_; }
  /// Of the last reading; reference and target are the measured position unless active.
  JointState snapshot() const;
  /// Largest |reference − measured| of a joint in the last step; 0 unless active.
  double tracking_error_rad() const { return tracking_error_rad_; }
  /// Largest |torque that holding takes − weight| of a joint; 0 while it does not hold at rest.
  double weight_error_nm() const { return weighing_.error_nm(); }

 private:
  bool is_active() const;
  bool may_follow() const;
  void weigh(const JointVector& weight_nm);
  void enter(ArmState state, ArmReason reason, int joint = -1);
  void fail(ArmReason reason, int joint);
  void expire(Time now);
  void heed(Time arrival, const JointCommand& command);
  void follow(Time arrival, const JointVector& target_rad);
  bool take_encoders(const ArmReading& reading);
  bool is_another_stream(Time reading);
  void heed_safety(const ArmReading& reading);
  void activate();
  void control();
  bool is_doubtful(const ArmReading& reading, Duration since_last);
  int find_jump(const JointVector& from_rad, const JointVector& to_rad, double dt_s) const;

  ArmModel arm_;
  ControllerOptions options_;
  ArmDynamics dynamics_;
  CommandGate gate_;
  JointReference reference_;
  JointServo servo_;
  ArmStatus status_;
  Safety safety_ = Safety::kEstop;
  bool board_was_idle_ = false;  // since the fault
  bool has_reading_ = false;
  Time time_;        // of the last reading
  Time older_time_;  // of the last one that was older than that
  int older_in_a_row_ = 0;
  // A reading that jumped, until the next one.
  bool has_doubt_ = false;
  JointVector doubted_rad_;
  Time doubted_time_;
  double dt_s_ = 0;  // before it
  Time command_time_, command_arrival_;
  int64_t commands_limited_ = 0;
  Weighing weighing_;
  JointMotion motion_;
  JointVector torque_nm_;
  double tracking_error_rad_ = 0;
};

}  // namespace foresight
