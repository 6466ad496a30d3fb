// What drawing takes, by the machine's own clock: a published clock stands still meanwhile.
#pragma once

#include <chrono>

#include "common/time.h"

namespace foresight {

class Stopwatch {
 public:
  /// `runs` is false on a simulated clock, where nothing takes time.
  explicit Stopwatch(bool runs) : runs_(runs) {}
  Duration elapsed() const {
    if (!runs_) return {};
    return microseconds(std::chrono::duration_cast<std::chrono::microseconds>(
                            std::chrono::steady_clock::now() - begin_)
                            .count());
  }

 private:
  bool runs_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace foresight
