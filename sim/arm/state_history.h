// The arm's recent motion: where its joints were at any instant of the last moments, for a camera
// whose exposure lies between two ticks. Positions follow a cubic between neighbouring ticks, with
// their velocities at the ends.
#pragma once

#include <algorithm>
#include <deque>

#include "common/check.h"
#include "common/time.h"
#include "sim/arm/plant.h"

namespace foresight::sim {

class StateHistory {
 public:
  explicit StateHistory(Duration length) : length_(length) {}

  /// `time` is later than the last one.
  void add(Time time, const ArmState& state) {
    FORESIGHT_CHECK(entries_.empty() || entries_.back().time < time);
    entries_.push_back({time, state});
    while (entries_.size() > 2 && entries_[1].time < time - length_) entries_.pop_front();
  }

  /// Outside of what is kept: the nearest state.
  ArmState at(Time time) const {
    FORESIGHT_CHECK(!entries_.empty());
    const auto after = std::lower_bound(entries_.begin(), entries_.end(), time,
                                        [](const Entry& e, Time t) { return e.time < t; });
    if (after == entries_.end()) return entries_.back().state;
    if (after == entries_.begin()) return entries_.front().state;
    return between(*(after - 1), *after, time);
  }

 private:
  struct Entry {
    Time time;
    ArmState state;
  };
  static ArmState between(const Entry& a, const Entry& b, Time time) {
    const double span_s = (b.time - a.time).seconds();
    const double u = (time - a.time).seconds() / span_s, w = 1 - u;
    const double from = w * w * (1 + 2 * u), to = u * u * (1 + 2 * w);
    const double from_velocity = span_s * u * w * w, to_velocity = -span_s * u * u * w;
    const ArmState &p = a.state, &q = b.state;
    return {from * p.position_rad + to * q.position_rad + from_velocity * p.velocity_rad_per_s +
                to_velocity * q.velocity_rad_per_s,
            w * p.velocity_rad_per_s + u * q.velocity_rad_per_s};
  }

  Duration length_;
  std::deque<Entry> entries_;
};

}  // namespace foresight::sim
