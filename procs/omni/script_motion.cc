#include "procs/omni/script_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <sstream>

#include "common/errors.h"

namespace foresight {
namespace {

constexpr double kEaseIn_s = 1.5;  // from rest to full pace
// Small ranges would otherwise ask for quick trembling: frequencies in rad/s per rad/s of the arm's
// peak velocity, and accelerations per velocity in 1/s.
constexpr double kMaxRatePerPeak = 2;

// Not std::uniform_real_distribution: its sequence differs between standard libraries.
class Dice {
 public:
  explicit Dice(int seed) : random_(static_cast<uint32_t>(seed)) {}
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(random_()) * (1.0 / 4294967296.0));
  }

 private:
  std::mt19937 random_;
};

// Progress after `time_s` of a motion whose pace rises smoothly from 0 to 1.
double eased_in(double time_s) {
  if (time_s >= kEaseIn_s) return time_s - kEaseIn_s / 2;
  constexpr double kRate = std::numbers::pi / kEaseIn_s;
  return time_s / 2 - std::sin(kRate * time_s) / (2 * kRate);
}

// The device's position that puts a joint somewhere.
double axis_from_joint(const JointMapping& mapping, const JointSource& joint, double joint_rad) {
  return (joint_rad - joint.offset_rad.value_or(0)) / (joint.scale * mapping.sign(joint.axis));
}

[[noreturn]] void refuse(const ScriptAxis& axis, size_t index, const AxisRange& range) {
  std::ostringstream line;
  line << "mapping: the home of joint " << axis.joint + 1 << " needs axis " << index + 1 << " at "
       << axis.centre_rad << " rad; the device reaches [" << range.lower_rad << ", "
       << range.upper_rad << "]";
  throw ConfigError(line.str());
}

// Narrows an axis so that one joint stays where it may be.
void narrow(const ArmModel& arm, const JointMapping& mapping, size_t joint, double margin_rad,
            const ScriptOptions& options, ScriptAxis& axis) {
  const JointSource& source = mapping.joints[joint];
  const ArmJoint& limits = arm.joints[joint];
  const double home = limits.home_rad;
  const double low = std::max(limits.lower_rad + margin_rad, home - options.range_rad);
  const double high = std::min(limits.upper_rad - margin_rad, home + options.range_rad);
  const double a = axis_from_joint(mapping, source, std::min(low, home));
  const double b = axis_from_joint(mapping, source, std::max(high, home));
  const double peak_rad_per_s = options.peak_rad_per_s / std::abs(source.scale);
  if (axis.joint < 0) {
    axis.joint = static_cast<int>(joint);
    axis.centre_rad = axis_from_joint(mapping, source, home);
    axis.peak_rad_per_s = peak_rad_per_s;
  }
  axis.lower_rad = std::max(axis.lower_rad, std::min(a, b));
  axis.upper_rad = std::min(axis.upper_rad, std::max(a, b));
  axis.peak_rad_per_s = std::min(axis.peak_rad_per_s, peak_rad_per_s);
}

}  // namespace

std::vector<ScriptAxis> plan_script_axes(const ArmModel& arm, const JointMapping& mapping,
                                         std::span<const AxisRange> ranges, double margin_rad,
                                         const ScriptOptions& options) {
  std::vector<ScriptAxis> axes;
  for (size_t i = 0; i < ranges.size(); ++i) {
    ScriptAxis axis{.lower_rad = ranges[i].lower_rad, .upper_rad = ranges[i].upper_rad};
    for (size_t j = 0; j < std::min(mapping.joints.size(), arm.joints.size()); ++j) {
      if (mapping.joints[j].axis == static_cast<int>(i) + 1) {
        narrow(arm, mapping, j, margin_rad, options, axis);
      }
    }
    if (axis.joint < 0) {  // nobody follows it
      axis.centre_rad = std::clamp(0.0, axis.lower_rad, axis.upper_rad);
      axis.lower_rad = axis.upper_rad = axis.centre_rad;
    } else if (!(axis.lower_rad <= axis.centre_rad && axis.centre_rad <= axis.upper_rad)) {
      refuse(axis, i, ranges[i]);
    }
    axes.push_back(axis);
  }
  return axes;
}

ScriptMotion::ScriptMotion(std::vector<ScriptAxis> axes, const ScriptOptions& options)
    : axes_(std::move(axes)),
      options_(options),
      warm_up_(plan_warm_up(start())),
      warm_up_s_(warm_up_.duration_s()) {
  Dice dice(options.seed);
  for (const ScriptAxis& axis : axes_) {
    Swing& swing = swings_.emplace_back();
    swing.amplitude_rad = (axis.upper_rad - axis.lower_rad) / 2;
    if (swing.amplitude_rad <= 0) continue;
    // Every wave starts where the axis is, so that the whole range is of use on either side.
    const double middle_rad = (axis.upper_rad + axis.lower_rad) / 2;
    const double begin =
        std::clamp((axis.centre_rad - middle_rad) / swing.amplitude_rad, -1.0, 1.0);
    swing.waves = {Wave{0.5, dice.uniform(0.5, 0.8), 0}, Wave{0.3, dice.uniform(0.9, 1.2), 0},
                   Wave{0.2, dice.uniform(1.3, 1.8), 0}};
    double steepness = 0;
    for (const Wave& wave : swing.waves) steepness += wave.weight * wave.rate_rad_per_s;
    const double rate = std::min(axis.peak_rad_per_s / (swing.amplitude_rad * steepness),
                                 kMaxRatePerPeak * options.peak_rad_per_s);
    for (Wave& wave : swing.waves) {
      wave.rate_rad_per_s *= rate;
      const bool rising = dice.uniform(0, 1) < 0.5;
      wave.phase_rad = rising ? std::asin(begin) : std::numbers::pi - std::asin(begin);
    }
  }
}

std::vector<double> ScriptMotion::start() const {
  std::vector<double> position_rad;
  for (const ScriptAxis& axis : axes_) position_rad.push_back(axis.centre_rad);
  return position_rad;
}

Motion ScriptMotion::plan_warm_up(const std::vector<double>& start) const {
  std::vector<MotionSample> samples{{0, true, start}};
  const auto sweep = [&](size_t index) {
    const ScriptAxis& axis = axes_[index];
    for (const double to_rad : {axis.upper_rad, axis.lower_rad, axis.centre_rad}) {
      MotionSample next = samples.back();
      const double distance_rad = std::abs(to_rad - next.position_rad[index]);
      if (distance_rad <= 0) continue;
      const double coasting_s = distance_rad / axis.peak_rad_per_s;
      next.time_s += std::max(kRestPeakVelocity * coasting_s,
                              std::sqrt(kRestPeakAcceleration * coasting_s / kMaxRatePerPeak));
      next.position_rad[index] = to_rad;
      samples.push_back(std::move(next));
    }
  };
  if (options_.warm_up) {
    for (size_t i = 0; i < axes_.size(); ++i) {
      if (axes_[i].joint == 0) sweep(i);
    }
    for (size_t i = 0; i < axes_.size(); ++i) sweep(i);
  }
  return Motion(std::move(samples), MotionStyle::kRest);
}

double ScriptMotion::Swing::at(double phase_s) const {
  double sum = 0;
  for (const Wave& wave : waves) {
    sum += wave.weight * std::sin(wave.rate_rad_per_s * phase_s + wave.phase_rad);
  }
  return amplitude_rad * sum;
}

// Time of the sinusoids: stands still while the hand holds still, and starts and stops smoothly.
double ScriptMotion::phase_s(double time_s) const {
  if (options_.hold_s <= 0) return eased_in(time_s);
  const double cycle_s = options_.move_s + options_.hold_s;
  const double cycles = std::floor(time_s / cycle_s);
  const double moving_s = std::min(time_s - cycles * cycle_s, options_.move_s);
  const double whole_s = options_.move_s - kEaseIn_s;  // progress of one cycle
  const double left_s = options_.move_s - moving_s;
  const double progress_s = left_s < kEaseIn_s ? whole_s - eased_in(left_s) : eased_in(moving_s);
  return cycles * whole_s + progress_s;
}

std::vector<double> ScriptMotion::at(double time_s) const {
  if (time_s <= warm_up_s_) return warm_up_.at(time_s).position_rad;
  const double phase = phase_s(time_s - warm_up_s_);
  std::vector<double> position_rad;
  for (size_t i = 0; i < axes_.size(); ++i) {
    const double middle_rad = (axes_[i].upper_rad + axes_[i].lower_rad) / 2;
    position_rad.push_back(middle_rad + swings_[i].at(phase));
  }
  return position_rad;
}

}  // namespace foresight
