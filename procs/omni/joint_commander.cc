#include "procs/omni/joint_commander.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace foresight {
namespace {

constexpr Duration kMeasuredMaxAge = seconds(1);
// After letting go, the arm needs at most so long to stop.
constexpr Duration kSettling = seconds(1);
// Of what the stamps of others say.
constexpr Duration kLongestRoundTrip = seconds(5);
// A pause of the process longer than this is not made up for.
constexpr double kMaxStep_s = 0.1;

}  // namespace

JointCommander::JointCommander(const ArmModel& arm, const JointMapping& mapping,
                               const CommanderOptions& options)
    : arm_(arm),
      mapping_(mapping),
      options_(options),
      command_rad_(arm.clamp(arm.home(), options.limit_margin_rad)),
      wish_rad_(command_rad_),
      offset_rad_(JointVector::Zero(arm.size())),
      velocity_rad_per_s_(options.max_velocity_rad_per_s) {}

bool JointCommander::set_measured(Time arrival, const JointVector& position_rad) {
  if (position_rad.size() != arm_.size() || !position_rad.allFinite()) return false;
  measured_rad_ = position_rad;
  measured_at_ = arrival;
  has_measured_ = true;
  return true;
}

bool JointCommander::is_usable(const DeviceReading& reading) {
  problem_.clear();
  if (!reading.connected) return false;
  if (static_cast<int>(reading.axes.size()) < mapping_.axes_needed()) {
    problem_ = "the device has " + std::to_string(reading.axes.size()) +
               " axes, the mapping needs " + std::to_string(mapping_.axes_needed());
  } else if (!std::all_of(reading.axes.begin(), reading.axes.end(),
                          [](double axis) { return std::isfinite(axis); })) {
    problem_ = "the device reads what is no number";
  }
  return problem_.empty();
}

void JointCommander::update(Time now, const DeviceReading& reading, bool engage) {
  const double elapsed_s = has_updated_ ? (now - updated_at_).seconds() : 0;
  const double step_s = std::clamp(elapsed_s, 0.0, kMaxStep_s);
  updated_at_ = now;
  has_updated_ = true;
  const bool goes_on = is_usable(reading) && engage;
  if (!goes_on || !engaged_) rest(now);
  if (!goes_on) return;
  if (!engaged_) {
    if (knows_arm(now)) return begin(reading);
    problem_ = "cannot engage: no JOINT_STATE";
    return;
  }
  limit(wish(reading, step_s));
  const double reach_rad = velocity_rad_per_s_ * step_s;
  command_rad_ += (wish_rad_ - command_rad_).cwiseMax(-reach_rad).cwiseMin(reach_rad);
  if (reading.kind == AxisKind::kVelocity) wish_rad_ = command_rad_;
}

bool JointCommander::knows_arm(Time now) const {
  return has_measured_ && now - measured_at_ <= kMeasuredMaxAge;
}

void JointCommander::set_round_trip(Duration round_trip) {
  round_trip_ = std::clamp(round_trip, Duration{0}, kLongestRoundTrip);
}

void JointCommander::set_velocity_limit(double limit_rad_per_s) {
  velocity_rad_per_s_ = options_.max_velocity_rad_per_s;
  if (limit_rad_per_s > 0) velocity_rad_per_s_ = std::min(velocity_rad_per_s_, limit_rad_per_s);
}

std::string JointCommander::slowness() const {
  if (velocity_rad_per_s_ >= options_.max_velocity_rad_per_s) return {};
  std::ostringstream line;
  line << "max_velocity_rad_per_s: " << options_.max_velocity_rad_per_s
       << " is above the limit of the arm's controller, " << velocity_rad_per_s_ << ", which holds";
  return line.str();
}

void JointCommander::stand_down() { engaged_ = limited_ = is_settling_ = false; }

// Not engaged: holds the last command until the arm has settled, then follows the measured arm.
void JointCommander::rest(Time now) {
  if (engaged_) {
    released_at_ = now;
    is_settling_ = true;
  }
  engaged_ = limited_ = false;
  is_settling_ = is_settling_ && now - released_at_ < kSettling + round_trip_;
  if (!is_settling_ && knows_arm(now)) {
    command_rad_ = wish_rad_ = arm_.clamp(measured_rad_, options_.limit_margin_rad);
  }
}

void JointCommander::begin(const DeviceReading& reading) {
  wish_rad_ = command_rad_;
  engaged_ = true;
  is_settling_ = false;
  if (reading.kind == AxisKind::kPosition) {
    offset_rad_ = command_rad_ - map_positions(mapping_, arm_, reading.axes);
  }
}

// Where the operator wants the joints, limits aside.
JointVector JointCommander::wish(const DeviceReading& reading, double step_s) {
  if (reading.kind == AxisKind::kVelocity) {
    const double step_rad = options_.axis_velocity_rad_per_s * step_s;
    return wish_rad_ + step_rad * map_deflections(mapping_, arm_, reading.axes);
  }
  const JointVector mapped_rad = map_positions(mapping_, arm_, reading.axes);
  if (options_.mode == MotionMode::kAbsolute) {
    const double fade_rad = options_.align_velocity_rad_per_s * step_s;
    offset_rad_ -= offset_rad_.cwiseMax(-fade_rad).cwiseMin(fade_rad);
    return mapped_rad + offset_rad_;
  }
  JointVector wanted_rad = mapped_rad + offset_rad_;
  offset_rad_ = arm_.clamp(wanted_rad, options_.limit_margin_rad) - mapped_rad;
  return wanted_rad;
}

void JointCommander::limit(const JointVector& wish_rad) {
  wish_rad_ = arm_.clamp(wish_rad, options_.limit_margin_rad);
  limited_ = (wish_rad_ - wish_rad).cwiseAbs().maxCoeff() > 1e-9;
}

}  // namespace foresight
