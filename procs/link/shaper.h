// One direction of the latency shaper: decides when each message leaves, or that it does not.
//
//   Shaper shaper({.delay_s = 0.15, .jitter_s = 0.01}, seed);
//   if (auto plan = shaper.admit(arrival, bytes)) send at plan->departure;
//
// Model: a bottleneck of `rate` with a bounded queue, then loss, then a delay with jitter. Order is
// kept among all messages of the direction (as on a TCP connection) except for those that
// `reorder` picks. Pure and seeded: the same arrivals give the same plan.
#pragma once

#include <cstddef>
#include <optional>
#include <random>

#include "common/time.h"

namespace foresight {

struct ShaperOptions {
  double delay_s = 0;
  double jitter_s = 0;          // uniform in ±jitter_s; the delay is never negative
  double loss = 0;              // probability, 0…1
  double reorder = 0;           // probability, 0…1
  double rate_bytes_per_s = 0;  // 0: unlimited
  double queue_s = 0.5;         // what the bottleneck holds at most, as time at its rate
};

struct ShaperPlan {
  Time departure;
  bool reordered = false;  // allowed to leave after messages that arrive later
};

enum class ShaperDrop { kNone, kLost, kQueueFull };

class Shaper {
 public:
  Shaper(const ShaperOptions& options, uint32_t seed) : options_(options), random_(seed) {}

  /// The plan for a message of `bytes` that arrives now; nothing when it is dropped (see
  /// last_drop()). Arrivals must not go back in time.
  std::optional<ShaperPlan> admit(Time arrival, size_t bytes);
  ShaperDrop last_drop() const { return last_drop_; }

 private:
  double uniform();  // [0, 1)

  ShaperOptions options_;
  std::mt19937 random_;
  Time bottleneck_free_{0};
  Time last_departure_{0};
  ShaperDrop last_drop_ = ShaperDrop::kNone;
};

}  // namespace foresight
