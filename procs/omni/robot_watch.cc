#include "procs/omni/robot_watch.h"

#include <algorithm>

namespace foresight {
namespace {

constexpr Duration kAnswerMargin = seconds(0.5);

std::string with(const std::string& line, const std::string& reason) {
  return reason.empty() ? line : line + ": " + reason;
}

}  // namespace

void RobotWatch::on_joints(Time arrival, Time robot_time, Time command_time,
                           std::optional<Duration> round_trip) {
  joints_arrival_ = arrival;
  round_trip_ = round_trip;
  if (engaged_ && !known_to_robot_ && command_time >= engaged_stamp_) known_to_robot_ = robot_time;
}

void RobotWatch::on_other_arm(Time arrival, int joint_count) {
  other_arm_arrival_ = arrival;
  other_arm_joints_ = joint_count;
}

bool RobotWatch::is_ours(const ControllerState& report) const {
  return report.driver_session == 0 || report.driver_session == session_;
}

// Older ones are passed over, unless nothing newer has come for a while: a stamp from the future
// must not shut out what follows.
void RobotWatch::on_report(Time arrival, const ControllerState& report) {
  const bool is_older = report_arrival_ && report.time < report_.time;
  if (is_older && !is_silent(report_arrival_, arrival)) return;
  report_ = report;
  report_arrival_ = arrival;
  if (!engaged_) return;
  const bool follows = report.state == ArmState::kFollowing && is_ours(report);
  if (followed_ && !follows) lost_ = true;
  if (follows && known_to_robot_ && report.time >= *known_to_robot_) {
    followed_ = true;
    complaint_.clear();
  }
}

void RobotWatch::on_command(Time now, Time stamp, bool is_engaged) {
  if (is_engaged == engaged_) return;
  if (!is_engaged && !followed_ && now - engaged_at_ > longest_wait()) {
    complaint_ = with("the arm has not followed", report_.reason);
  }
  engaged_ = is_engaged;
  followed_ = lost_ = false;
  known_to_robot_.reset();
  engaged_at_ = now;
  engaged_stamp_ = stamp;
}

bool RobotWatch::is_silent(const std::optional<Time>& arrival, Time now) const {
  return !arrival || now - *arrival > options_.silence;
}

Duration RobotWatch::longest_wait() const {
  if (!round_trip_ || round_trip_->us < 0) return options_.longest_round_trip;
  const Duration wait = std::min(*round_trip_, options_.longest_round_trip) * 2 + kAnswerMargin;
  return std::min(wait, options_.longest_round_trip);
}

std::string RobotWatch::missing(Time now) const {
  if (!is_silent(other_arm_arrival_, now)) {
    return "cannot engage: the robot's arm has " + std::to_string(other_arm_joints_) +
           " joints, this one (arm_file) has " + std::to_string(joint_count_);
  }
  if (is_silent(joints_arrival_, now)) return "cannot engage: no JOINT_STATE";
  if (is_silent(report_arrival_, now)) return "cannot engage: no CONTROLLER_STATE";
  return {};
}

std::string RobotWatch::refusal() const {
  if (report_.state == ArmState::kIdle) return with("the arm is idle", report_.reason);
  if (report_.state == ArmState::kFault) return with("the arm has a fault", report_.reason);
  if (report_.state > ArmState::kFault || report_.state < ArmState::kIdle) {
    return "the arm is in a state that is not known here";
  }
  if (!is_ours(report_)) {
    return "another operator drives (session " + std::to_string(report_.driver_session) + ")";
  }
  if (report_.needs_release) {
    return with("the arm waits for the clutch to be let go", report_.reason);
  }
  return {};
}

std::string RobotWatch::obstacle(Time now) const {
  if (std::string line = missing(now); !line.empty()) return line;
  if (std::string line = refusal(); !line.empty()) return line;
  const bool waits_in_vain = engaged_ && !followed_ && now - engaged_at_ > longest_wait();
  if (lost_ || waits_in_vain) return with("the arm does not follow", report_.reason);
  return {};
}

}  // namespace foresight
