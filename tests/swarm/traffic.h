// Counts and hashes everything that is published in a simulation: equal sums mean equal traffic.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "common/fnv.h"
#include "common/simulation.h"

namespace foresight {

struct Traffic {
  std::map<std::string, int> counts;
  Fnv1a bytes_and_times;
  uint64_t hash = 0;  // of all so far

  void add(Time time, Domain domain, const std::string& channel, std::span<const uint8_t> bytes) {
    ++counts[channel];
    bytes_and_times.add_value(time.us);
    bytes_and_times.add_value(domain);
    bytes_and_times.add(bytes);
    hash = bytes_and_times.value();
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
