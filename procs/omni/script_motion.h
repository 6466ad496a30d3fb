// The hand of a simulated operator: a seeded motion of the device's joints that keeps the arm
// inside its limits and below a velocity.
//
//   const auto axes = plan_script_axes(arm, mapping, kOmniRanges, margin_rad, options);
//   const ScriptMotion motion(axes, options);
//   device_rad = motion.at(time_s);
//
// 1. It starts at rest where the mapping gives the arm's home.
// 2. Warm-up: one axis after the other, that of the arm's first joint first and twice, goes to its
//    upper end, to its lower end and back. The first joint carries the camera sideways, so that
//    slam gets a baseline; it and the others turn the hand about different directions, so that the
//    calibration gets rotations about two axes.
// 3. Then for ever a sum of three sinusoids per axis, in turns moving and holding still. Each axis
//    uses its whole range; its frequencies follow from the velocity.
// A function of time, the seed and the options alone.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/arm_model.h"
#include "procs/omni/joint_mapping.h"
#include "procs/omni/motion.h"
#include "procs/omni/omni_model.h"

namespace foresight {

struct ScriptOptions {
  int seed = 1;
  bool warm_up = true;
  double range_rad = 0.4;       // of each joint of the arm, to either side of home
  double peak_rad_per_s = 0.4;  // of each joint of the arm
  double move_s = 20;           // moving and …
  double hold_s = 1;            // … holding still, in turns; 0: moves on
};

/// How one axis of the device may move.
struct ScriptAxis {
  double centre_rad = 0;                // where the arm is at home
  double lower_rad = 0, upper_rad = 0;  // equal: the axis stands still
  double peak_rad_per_s = 0;
  int joint = -1;  // the first joint of the arm that follows it
};

/// One per device range. Throws ConfigError when the device does not reach the arm's home.
std::vector<ScriptAxis> plan_script_axes(const ArmModel& arm, const JointMapping& mapping,
                                         std::span<const AxisRange> ranges, double margin_rad,
                                         const ScriptOptions& options);

class ScriptMotion {
 public:
  ScriptMotion(std::vector<ScriptAxis> axes, const ScriptOptions& options);
  /// Positions of the device's axes; before time 0 those of the start.
  std::vector<double> at(double time_s) const;
  double warm_up_s() const { return warm_up_s_; }

 private:
  struct Wave {
    double weight, rate_rad_per_s, phase_rad;
  };
  struct Swing {
    double amplitude_rad = 0;
    std::array<Wave, 3> waves{};
    double at(double phase_s) const;
  };
  std::vector<double> start() const;
  Motion plan_warm_up(const std::vector<double>& start) const;
  double phase_s(double time_s) const;

  std::vector<ScriptAxis> axes_;
  ScriptOptions options_;
  Motion warm_up_;
  double warm_up_s_;
  std::vector<Swing> swings_;
};

}  // namespace foresight
