#include "procs/link/shaper.h"

#include <algorithm>

namespace foresight {

// Not std::uniform_real_distribution: its sequence differs between standard libraries.
double Shaper::uniform() { return static_cast<double>(random_()) * (1.0 / 4294967296.0); }

std::optional<ShaperPlan> Shaper::admit(Time arrival, size_t bytes) {
  // Always three draws, so that one option does not change another's random sequence.
  const double loss_draw = uniform(), jitter_draw = uniform(), reorder_draw = uniform();
  Time sent = arrival;
  if (options_.rate_bytes_per_s > 0) {
    const Time begin = std::max(arrival, bottleneck_free_);
    if ((begin - arrival).seconds() > options_.queue_s) {
      last_drop_ = ShaperDrop::kQueueFull;
      return std::nullopt;
    }
    sent = begin + seconds(static_cast<double>(bytes) / options_.rate_bytes_per_s);
    bottleneck_free_ = sent;
  }
  if (loss_draw < options_.loss) {
    last_drop_ = ShaperDrop::kLost;
    return std::nullopt;
  }
  last_drop_ = ShaperDrop::kNone;
  const double delay_s =
      std::max(0.0, options_.delay_s + options_.jitter_s * (2 * jitter_draw - 1));
  if (reorder_draw < options_.reorder) {
    // Held back by half the delay or 50 ms, whichever is longer.
    return ShaperPlan{sent + seconds(delay_s + std::max(0.05, 0.5 * options_.delay_s)), true};
  }
  last_departure_ = std::max(last_departure_, sent + seconds(delay_s));
  return ShaperPlan{last_departure_, false};
}

}  // namespace foresight
