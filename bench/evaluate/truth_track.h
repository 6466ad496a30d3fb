// The simulated world's truth over the last seconds, at any instant (TRUTH_STATE, interpolated).
#pragma once

#include <deque>
#include <optional>
#include <span>

#include "common/arm_model.h"
#include "common/frames.h"
#include "common/time.h"

namespace foresight {

struct Truth {
  Time time;
  Pose<World, Base> world_from_base;
  Pose<World, Cam> world_from_cam;
  JointVector position_rad, velocity_rad_per_s;
};

class TruthTrack {
 public:
  /// A message on TRUTH_STATE.
  void on_message(std::span<const uint8_t> bytes);
  /// Nothing when the instant is not (or no longer) covered.
  std::optional<Truth> at(Time time) const;
  const std::deque<Truth>& states() const { return states_; }

 private:
  std::deque<Truth> states_;
};

}  // namespace foresight
