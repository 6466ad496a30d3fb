// A time that never goes back, from a clock that may be set: what is held or waited for must not
// last longer because the clock was stepped back. A step forward passes as a long wait.
#pragma once

#include <algorithm>
#include <optional>

#include "common/time.h"

namespace foresight {

class SteadyTime {
 public:
  /// Equal to `now` as long as the clock has not gone back.
  Time at(Time now) {
    if (clock_ && now > *clock_) steady_ = steady_ + std::min(now - *clock_, kLongest);
    if (!clock_) steady_ = now;
    clock_ = now;
    return steady_;
  }

 private:
  static constexpr Duration kLongest = seconds(3600.0);
  std::optional<Time> clock_;
  Time steady_;
};

}  // namespace foresight
