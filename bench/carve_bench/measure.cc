#include "bench/carve_bench/measure.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <numeric>

#include "common/cpu_time.h"
#include "common/peak_memory.h"

namespace foresight {
namespace {

double timed_apply(Carver& carver, const MapDelta& delta, CarvingDelta* result) {
  const double start = thread_cpu_ms();
  *result = carver.apply(delta);
  return thread_cpu_ms() - start;
}

double timed_update(Mesher& mesher, const CarvingDelta& delta, Mesh* mesh) {
  const double start = thread_cpu_ms();
  if (mesher.apply(delta) != ApplyResult::kOk) {
    std::fprintf(stderr, "the mesher rejects a delta of the carver\n");
    std::exit(1);
  }
  *mesh = mesher.update();
  return thread_cpu_ms() - start;
}

// The carver alone first: its memory is what grows meanwhile.
void time_carver(const CarvSequence& sequence, const CarveMeasurement& how, CarveResult* result) {
  forget_peak_memory();
  const double before_mb = peak_memory_mb();
  result->carve_ms.assign(sequence.events.size(), 0.0);
  CarvingDelta delta;
  for (int n = 0; n < how.repeat; ++n) {
    Carver carver(how.carver);
    for (size_t i = 0; i < sequence.events.size(); ++i) {
      const CarvEvent& event = sequence.events[i];
      const double ms = timed_apply(carver, event.delta, &delta);
      result->events[static_cast<size_t>(event.kind)].ms.push_back(ms);
      result->carve_ms[i] += ms / how.repeat;
    }
    result->statistics = carver.statistics();
  }
  result->peak_memory_mb = peak_memory_mb() - before_mb;
  const MapDelta whole = final_map(sequence);
  for (int n = 0; n < how.repeat; ++n) {
    Carver carver(how.carver);
    result->from_scratch.ms.push_back(timed_apply(carver, whole, &delta));
  }
}

void time_mesher(const CarvSequence& sequence, const CarveMeasurement& how, CarveResult* result) {
  result->cut_ms.assign(sequence.events.size(), 0.0);
  for (int n = 0; n < how.repeat; ++n) {
    Carver carver(how.carver);
    Mesher mesher(how.mesher);
    for (size_t i = 0; i < sequence.events.size(); ++i) {
      const CarvingDelta delta = carver.apply(sequence.events[i].delta);
      result->cuts.ms.push_back(timed_update(mesher, delta, &result->mesh));
      result->cut_ms[i] += result->cuts.ms.back() / how.repeat;
    }
    result->cut = mesher.statistics();
    Mesher anew(how.mesher);
    Mesh mesh;
    result->cut_from_scratch.ms.push_back(timed_update(anew, carver.snapshot(), &mesh));
  }
}

}  // namespace

double Times::mean() const {
  if (ms.empty()) return 0.0;
  return std::accumulate(ms.begin(), ms.end(), 0.0) / static_cast<double>(ms.size());
}

double Times::quantile(double share) const {
  if (ms.empty()) return 0.0;
  std::vector<double> sorted = ms;
  std::sort(sorted.begin(), sorted.end());
  const auto last = static_cast<double>(sorted.size() - 1);
  return sorted[static_cast<size_t>(std::min(last, share * static_cast<double>(sorted.size())))];
}

CarveResult measure(const CarvSequence& sequence, const CarveMeasurement& how) {
  CarveResult result;
  time_carver(sequence, how, &result);
  if (!how.carver_only) time_mesher(sequence, how, &result);
  return result;
}

}  // namespace foresight
