// Counts and hashes everything that is published in a simulation: equal sums mean equal traffic.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "common/simulation.h"

namespace foresight {

struct Traffic {
  std::map<std::string, int> counts;
  uint64_t hash = 1469598103934665603ull;

  void add(Time time, Domain domain, const std::string& channel, std::span<const uint8_t> bytes) {
    ++counts[channel];
    hash ^= static_cast<uint64_t>(time.us) * 2 + (domain == Domain::kRobot ? 0 : 1);
    for (uint8_t b : bytes) hash = (hash ^ b) * 1099511628211ull;
  }
};

/// Runs a RecordedLine or a ClosedLoop to its end.
template <class Loop>
Traffic run_all(Loop& loop) {
  Traffic traffic;
  loop.world().set_tap([&](Time time, Domain domain, const std::string& channel, auto bytes) {
    traffic.add(time, domain, channel, bytes);
  });
  while (loop.step()) {
  }
  loop.world().set_tap({});
  return traffic;
}

}  // namespace foresight
