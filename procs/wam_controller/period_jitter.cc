#include "procs/wam_controller/period_jitter.h"

#include <algorithm>
#include <cstdlib>

namespace foresight {

void PeriodJitter::tick(Time now) {
  if (has_last_) {
    samples_[count_ % samples_.size()] = {now, {std::abs((now - last_ - nominal_).us)}};
    ++count_;
  }
  last_ = now;
  has_last_ = true;
}

double PeriodJitter::p99_ms(Time now) const {
  std::array<int64_t, 1024> errors_us;
  size_t size = 0;
  for (size_t i = 0; i < std::min(count_, samples_.size()); ++i) {
    const Duration age = now - samples_[i].time;
    if (age.us < 0 || age > seconds(1)) continue;  // negative: the clock has been set back
    errors_us[size++] = samples_[i].error.us;
  }
  if (size == 0) return 0;
  const auto rank = static_cast<std::ptrdiff_t>((size - 1) * 99 / 100);
  const auto end = errors_us.begin() + static_cast<std::ptrdiff_t>(size);
  std::nth_element(errors_us.begin(), errors_us.begin() + rank, end);
  return 1e-3 * static_cast<double>(errors_us[static_cast<size_t>(rank)]);
}

}  // namespace foresight
