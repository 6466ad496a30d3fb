// A motion of the device's joints that is given by samples: waypoints, or what a person once did.
//
//   const Motion motion(parse_motion_table(text, path), MotionStyle::kLinear);
//   const MotionSample now = motion.at(1.25);
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace foresight {

struct MotionSample {
  double time_s = 0;
  bool engaged = true;
  std::vector<double> position_rad;
};

enum class MotionStyle : unsigned char {
  kLinear,  // straight between samples: for dense recordings
  kRest,    // at rest at each sample, smooth in between (quintic, jerk without steps)
};

class Motion {
 public:
  /// At least one sample; times increase; all have the same joints.
  Motion(std::vector<MotionSample> samples, MotionStyle style);

  /// Before the first sample the first, after the last the last. O(log n).
  MotionSample at(double time_s) const;
  double duration_s() const { return samples_.back().time_s - samples_.front().time_s; }
  const MotionSample& front() const { return samples_.front(); }

 private:
  std::vector<MotionSample> samples_;
  MotionStyle style_;
};

/// The greatest velocity and acceleration of a kRest motion over 1 rad in 1 s.
constexpr double kRestPeakVelocity = 1.875;
constexpr double kRestPeakAcceleration = 5.774;

/// Reads a table: a line of column names, `time_s`, optionally `engaged` (0 or 1), then one per
/// joint in rad; then numbers, separated by commas or spaces. Lines that begin with # are passed
/// over. `name` appears in error lines. Throws ConfigError.
std::vector<MotionSample> parse_motion_table(std::string_view text, const std::string& name);

}  // namespace foresight
