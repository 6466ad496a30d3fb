// Times the cores of carver and mesher on a recorded map sequence: CPU times of the thread.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bench/carve_bench/carv_reader.h"
#include "procs/carver/carver.h"
#include "procs/mesher/mesher.h"

namespace foresight {

/// Milliseconds of several runs.
struct Times {
  std::vector<double> ms;
  double mean() const;
  /// 0.5: the median; 1: the maximum. 0 if there are none.
  double quantile(double share) const;
};

struct CarveResult {
  std::array<Times, 3> events;  // `Carver::apply`, by CarvEventKind
  Times from_scratch;
  Times cuts, cut_from_scratch;          // `Mesher::apply` and `update`: from a delta to the mesh
  std::vector<double> carve_ms, cut_ms;  // by event of the sequence, means over the runs
  CarverStatistics statistics;
  CutStatistics cut;
  Mesh mesh;
  double peak_memory_mb = 0.0;  // what the carver let the process grow by
};

struct CarveMeasurement {
  CarverOptions carver;
  MesherOptions mesher;
  bool carver_only = false;
  int repeat = 1;
};

/// The sequence event by event, and its final state at once. Ends the program if the mesher refuses
/// what the carver sends.
CarveResult measure(const CarvSequence& sequence, const CarveMeasurement& how);

}  // namespace foresight
