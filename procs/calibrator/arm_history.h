// The arm's recent motion, from its joint readings through forward kinematics.
//
//   ArmHistory history({});
//   if (history.add(time, base_from_ee) == ArmHistory::Added::kJump) …
//   auto motion = history.at(frame_time);          // nothing: not covered
//
// What it refuses to do: interpolate across a gap, or across a jump that no arm can make (a fault
// of an encoder, a controller that was restarted): there the history begins anew, once a second
// reading agrees with the first after the jump. A single forged one changes nothing.
#pragma once

#include <deque>
#include <optional>

#include "procs/calibrator/arm_track.h"

namespace foresight::calibration {

struct ArmHistoryOptions {
  double length_s = 60;
  double max_gap_s = 0.06;
  double max_speed_m_per_s = 5;
  double max_turn_rad_per_s = 15;
};

class ArmHistory {
 public:
  enum class Added { kAdded, kNotNewer, kDoubted, kJump };

  explicit ArmHistory(const ArmHistoryOptions& options) : options_(options) {}

  /// O(1). A jump is doubted first, and believed when the next reading agrees. A reading older than
  /// the newest is refused; one much older (a clock that was set back) begins the history anew.
  Added add(Time time, const Pose<Base, Ee>& base_from_ee);
  /// Where the arm was; empty when the instant is not between two readings of one piece.
  std::optional<ArmMotion> at(Time time) const;
  /// All readings within ±half_width of an instant; empty unless they cover it without a gap.
  std::optional<ArmTrack> around(Time centre, Duration half_width) const;
  bool empty() const { return samples_.empty(); }
  /// Time of the first and the last reading; only when not empty().
  Time oldest() const { return samples_.front().time; }
  Time newest() const { return samples_.back().time; }

 private:
  bool is_gap(const ArmSample& a, const ArmSample& b) const {
    return (b.time - a.time).seconds() > options_.max_gap_s;
  }
  bool is_jump(const ArmSample& a, const ArmSample& b) const;

  ArmHistoryOptions options_;
  std::deque<ArmSample> samples_;
  std::optional<ArmSample> doubted_;  // the first after a jump
};

}  // namespace foresight::calibration
