#include "procs/wam_controller/arm_controller.h"

#include <algorithm>
#include <cmath>

namespace foresight {
namespace {

// What quantisation and a late time-stamp may add to a joint's way between two readings.
constexpr double kJumpTolerance_rad = 0.02;
// Readings that follow each other, but are older than the last one: that one was the odd one out.
constexpr int kOlderReadingsWin = 3;

JointVector zeros(int size) { return JointVector::Zero(size); }

int largest(const JointVector& values) {
  Eigen::Index row = 0;
  values.cwiseAbs().maxCoeff(&row);
  return static_cast<int>(row);
}

}  // namespace

const char* to_string(ArmReason reason) {
  switch (reason) {
    case ArmReason::kNone:
      return "";
    case ArmReason::kNoEncoders:
      return "no encoder readings";
    case ArmReason::kEstop:
      return "E-STOP";
    case ArmReason::kNotActivated:
      return "the arm is not activated (pendant)";
    case ArmReason::kNoCommandYet:
      return "waits for an engaged command";
    case ArmReason::kCommandsEnded:
      return "commands stopped coming";
    case ArmReason::kLetGo:
      return "the operator let go";
    case ArmReason::kNeedsRelease:
      return "let go and press again";
    case ArmReason::kIsWeighed:
      return "is being weighed";
    case ArmReason::kWeight:
      return "holding it takes another torque than its weight: a wrong home position, a load, or "
             "something pushes";
    case ArmReason::kEncoderJump:
      return "encoder jumped";
    case ArmReason::kTrackingError:
      return "too far from its reference";
    case ArmReason::kSafetyFault:
      return "fault of the safety board";
    case ArmReason::kNoNumber:
      return "torque is not a number";
  }
  return "?";
}

ArmController::ArmController(const ArmModel& arm, const ControllerOptions& options)
    : arm_(arm),
      options_(options),
      dynamics_(arm, options.gravity_in_base_m_per_s2),
      gate_({arm.size(), options.command_max_age, options.limits.command_timeout}),
      reference_(options.limits.motion),
      servo_(arm, options.velocity_filter_hz),
      weighing_(options.weight_tolerance_nm, arm.size()),
      motion_{zeros(arm.size()), zeros(arm.size()), zeros(arm.size())},
      torque_nm_(zeros(arm.size())) {}

bool ArmController::is_active() const {
  return status_.state != ArmState::kIdle && status_.state != ArmState::kFault;
}

bool ArmController::may_follow() const {
  const bool is_weight_good = options_.is_weighed_first
                                  ? weighing_.result() == Weighing::Result::kAgrees
                                  : weighing_.result() != Weighing::Result::kContradicts;
  return is_active() && is_weight_good;
}

void ArmController::enter(ArmState state, ArmReason reason, int joint) {
  status_ = {state, reason, joint};
  if (is_active()) return;
  gate_.revoke();
  weighing_.reset();
  torque_nm_.setZero();
  tracking_error_rad_ = 0;
}

void ArmController::fail(ArmReason reason, int joint) {
  enter(ArmState::kFault, reason, joint);
  board_was_idle_ = safety_ == Safety::kIdle;
}

CommandVerdict ArmController::on_command(Time arrival, const JointCommand& command) {
  expire(arrival);
  const CommandVerdict verdict = gate_.admit(arrival, command, may_follow());
  if (status_.state == ArmState::kFollowing && !gate_.has_driver()) {
    reference_.stop(arrival);
    enter(ArmState::kStopping, ArmReason::kLetGo);
  }
  const bool is_dealt_with =
      verdict == CommandVerdict::kAccepted || verdict == CommandVerdict::kNeedsRelease;
  if (!is_dealt_with || gate_.is_aside(command.session)) return verdict;
  command_time_ = command.time;
  command_arrival_ = arrival;
  if (may_follow()) heed(arrival, command);
  return verdict;
}

// Of an arm that may follow: a command that comes from the driver, or while nobody drives.
void ArmController::heed(Time arrival, const JointCommand& command) {
  if (gate_.has_driver()) {
    follow(arrival, command.position_rad);
  } else if (command.is_engaged) {
    enter(status_.state, ArmReason::kNeedsRelease);
  } else if (status_.reason == ArmReason::kNeedsRelease) {
    enter(status_.state, ArmReason::kLetGo);
  }
}

void ArmController::follow(Time arrival, const JointVector& target_rad) {
  const JointVector inside = arm_.clamp(target_rad, options_.limits.joint_margin_rad);
  if (inside != target_rad) ++commands_limited_;
  reference_.follow(arrival, inside);
  enter(ArmState::kFollowing, ArmReason::kNone);
}

// The stop begins exactly when the driver's lease is over, however late this is noticed.
void ArmController::expire(Time now) {
  gate_.expire(now);
  if (status_.state != ArmState::kFollowing || gate_.has_driver()) return;
  reference_.stop(std::min(now, command_arrival_ + options_.limits.command_timeout));
  enter(ArmState::kStopping, ArmReason::kCommandsEnded);
}

const JointVector& ArmController::step(const ArmReading& reading) {
  if (!take_encoders(reading)) return torque_nm_;
  heed_safety(reading);
  if (is_active()) control();
  return torque_nm_;
}

// False for a reading that is not newer than the last one. A gap ends the activity: what the arm
// did meanwhile is not known.
bool ArmController::take_encoders(const ArmReading& reading) {
  const Duration since_last = reading.time - time_;
  const bool is_gap = !has_reading_ || since_last > options_.encoder_timeout ||
                      since_last < options_.encoder_timeout * -1 || is_another_stream(reading.time);
  if (!is_gap && (since_last.us <= 0 || is_doubtful(reading, since_last))) return false;
  time_ = reading.time;
  has_reading_ = true;
  safety_ = reading.safety;
  dt_s_ = is_gap ? 0 : since_last.seconds();
  if (is_gap) {
    if (is_active()) enter(ArmState::kIdle, ArmReason::kNoEncoders);
    servo_.reset(reading.position_rad);
    return true;
  }
  const int jumped = find_jump(servo_.position_rad(), reading.position_rad, dt_s_);
  if (jumped < 0) {
    servo_.measure(reading.position_rad, dt_s_);
    return true;
  }
  servo_.reset(reading.position_rad);
  if (is_active()) fail(ArmReason::kEncoderJump, jumped);
  return true;
}

// One reading from the future must not make all others old: the stream that keeps coming wins.
bool ArmController::is_another_stream(Time reading) {
  if (reading >= time_) {
    older_in_a_row_ = 0;
    return false;
  }
  older_in_a_row_ = older_in_a_row_ > 0 && reading > older_time_ ? older_in_a_row_ + 1 : 1;
  older_time_ = reading;
  if (older_in_a_row_ < kOlderReadingsWin) return false;
  older_in_a_row_ = 0;
  return true;
}

// A jump that no arm makes, once: the next reading tells whether the encoder has jumped or this one
// was none of the arm's. Meanwhile the torque stays; readings that never agree are none at all.
bool ArmController::is_doubtful(const ArmReading& reading, Duration since_last) {
  const bool jumps =
      find_jump(servo_.position_rad(), reading.position_rad, since_last.seconds()) >= 0;
  const bool is_confirmed =
      has_doubt_ && reading.time > doubted_time_ &&
      find_jump(doubted_rad_, reading.position_rad, (reading.time - doubted_time_).seconds()) < 0;
  has_doubt_ = jumps && !is_confirmed;
  doubted_rad_ = reading.position_rad;
  doubted_time_ = reading.time;
  return has_doubt_;
}

// The joint that has gone further than any arm does in that time; −1: none.
int ArmController::find_jump(const JointVector& from_rad, const JointVector& to_rad,
                             double dt_s) const {
  const JointVector way = to_rad - from_rad;
  const int joint = largest(way);
  const double possible = options_.encoder_jump_rad_per_s * dt_s + kJumpTolerance_rad;
  return std::abs(way[joint]) > possible ? joint : -1;
}

void ArmController::heed_safety(const ArmReading& reading) {
  const bool is_board_active = reading.safety == Safety::kActive;
  if (status_.state == ArmState::kFault) {
    board_was_idle_ = board_was_idle_ || reading.safety == Safety::kIdle;
    if (is_board_active && board_was_idle_ && reading.fault.empty()) activate();
  } else if (!reading.fault.empty()) {
    fail(ArmReason::kSafetyFault, -1);
  } else if (!is_board_active) {
    const bool is_estop = reading.safety == Safety::kEstop;
    enter(ArmState::kIdle, is_estop ? ArmReason::kEstop : ArmReason::kNotActivated);
  } else if (status_.state == ArmState::kIdle) {
    activate();
  }
}

void ArmController::activate() {
  servo_.reset(servo_.position_rad());
  reference_.rest(time_, servo_.position_rad());
  enter(ArmState::kHolding,
        options_.is_weighed_first ? ArmReason::kIsWeighed : ArmReason::kNoCommandYet);
}

void ArmController::control() {
  expire(time_);
  if (status_.state == ArmState::kStopping && reference_.is_at_rest(time_)) {
    enter(ArmState::kHolding, status_.reason);
  }
  motion_ = reference_.at(time_);
  const JointVector error = motion_.position_rad - servo_.position_rad();
  const int worst = largest(error);
  tracking_error_rad_ = std::abs(error[worst]);
  if (!(tracking_error_rad_ <= options_.tracking_error_limit_rad)) {
    return fail(ArmReason::kTrackingError, worst);
  }
  const JointVector rest = zeros(arm_.size());
  const bool moves = options_.inertia_feed_forward;
  const JointVector feed_forward =
      dynamics_.torque_nm(servo_.position_rad(), moves ? motion_.velocity_rad_per_s : rest,
                          moves ? motion_.acceleration_rad_per_s2 : rest);
  torque_nm_ = servo_.torque_nm(motion_, feed_forward, dt_s_);
  if (!torque_nm_.allFinite()) return fail(ArmReason::kNoNumber, -1);
  weigh(feed_forward);
}

// At rest the feed-forward is the weight alone.
void ArmController::weigh(const JointVector& weight_nm) {
  if (status_.state != ArmState::kHolding) return weighing_.pause();
  const Weighing::Result before = weighing_.result();
  weighing_.add(dt_s_, torque_nm_ - weight_nm);
  if (weighing_.result() == before) return;
  if (weighing_.result() == Weighing::Result::kContradicts) {
    gate_.revoke();
    enter(ArmState::kHolding, ArmReason::kWeight, weighing_.worst_joint());
  } else if (status_.reason == ArmReason::kWeight || status_.reason == ArmReason::kIsWeighed) {
    enter(ArmState::kHolding, ArmReason::kNoCommandYet);
  }
}

void ArmController::on_time(Time now) {
  const bool is_silent = has_reading_ && now - time_ > options_.encoder_timeout;
  if (!is_silent) return;
  has_reading_ = false;
  if (status_.state != ArmState::kFault) enter(ArmState::kIdle, ArmReason::kNoEncoders);
}

JointState ArmController::snapshot() const {
  JointState s{.time = time_,
               .position_rad = servo_.position_rad(),
               .velocity_rad_per_s = servo_.velocity_rad_per_s(),
               .reference_rad = motion_.position_rad,
               .reference_velocity_rad_per_s = motion_.velocity_rad_per_s,
               .target_rad = reference_.target_rad(),
               .command_time = command_time_,
               .command_arrival = command_arrival_};
  if (is_active()) return s;
  s.reference_rad = s.target_rad = s.position_rad;
  s.reference_velocity_rad_per_s = zeros(arm_.size());
  return s;
}

}  // namespace foresight
