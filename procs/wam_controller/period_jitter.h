// How evenly a loop runs: the 99th percentile of |period − nominal period| over the last second.
// No allocation, no exceptions.
#pragma once

#include <array>
#include <cstddef>

#include "common/time.h"

namespace foresight {

class PeriodJitter {
 public:
  explicit PeriodJitter(Duration nominal) : nominal_(nominal) {}

  /// The loop runs now.
  void tick(Time now);
  /// Of the periods that ended within the last second (the last 1024 of them); 0 without any.
  double p99_ms(Time now) const;

 private:
  struct Sample {
    Time time;
    Duration error{0};
  };
  Duration nominal_;
  std::array<Sample, 1024> samples_;
  size_t count_ = 0;  // since start
  Time last_;
  bool has_last_ = false;
};

}  // namespace foresight
