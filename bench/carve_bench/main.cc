// carve-bench: times the carver's core on a recorded map sequence. Times are CPU times of the
// thread, of `Carver::apply` alone.
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <numeric>
#include <string>
#include <vector>

#include "bench/carve_bench/carv_reader.h"
#include "procs/carver/carver.h"

namespace {

using foresight::Carver;
using foresight::CarverOptions;
using foresight::CarverStatistics;
using foresight::CarvSequence;
using foresight::MapDelta;

struct Arguments {
  std::string input, json;
  bool reference_setup = false;
  int repeat = 1;
  int max_constraints = 0;
  double rebuild_cost_ratio = 1.0;
};

// Milliseconds per event of one kind.
struct Times {
  std::vector<double> ms;
  double mean() const {
    return ms.empty() ? 0.0
                      : std::accumulate(ms.begin(), ms.end(), 0.0) / static_cast<double>(ms.size());
  }
  double quantile(double share) const {
    if (ms.empty()) return 0.0;
    std::vector<double> sorted = ms;
    std::sort(sorted.begin(), sorted.end());
    const auto last = static_cast<double>(sorted.size() - 1);
    return sorted[static_cast<size_t>(std::min(last, share * static_cast<double>(sorted.size())))];
  }
};

struct Result {
  std::array<Times, 3> events;  // by CarvEventKind
  Times from_scratch;
  CarverStatistics statistics;
  int64_t rebuilds = 0;
  double peak_memory_mb = 0.0;
};

constexpr std::array<const char*, 3> kKindNames{"keyframe", "deletion", "adjustment"};

double thread_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

double timed_apply(Carver& carver, const MapDelta& delta) {
  const double start = thread_ms();
  const auto result = carver.apply(delta);
  return thread_ms() - start;
}

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

Result run(const CarvSequence& sequence, const CarverOptions& options, int repeat) {
  Result result;
  const double before_mb = peak_memory_mb();
  for (int n = 0; n < repeat; ++n) {
    Carver carver(options);
    for (const auto& event : sequence.events) {
      result.events[static_cast<size_t>(event.kind)].ms.push_back(timed_apply(carver, event.delta));
    }
    result.statistics = carver.statistics();
  }
  result.peak_memory_mb = peak_memory_mb() - before_mb;
  const MapDelta whole = foresight::final_map(sequence);
  for (int n = 0; n < repeat; ++n) {
    Carver carver(options);
    result.from_scratch.ms.push_back(timed_apply(carver, whole));
  }
  return result;
}

void print(const Result& result) {
  for (size_t kind = 0; kind < 3; ++kind) {
    const Times& t = result.events[kind];
    if (t.ms.empty()) continue;
    std::printf("%-12s %6zu events  %.2f / %.2f / %.2f ms mean / p95 / max\n", kKindNames[kind],
                t.ms.size(), t.mean(), t.quantile(0.95), t.quantile(1.0));
  }
  const CarverStatistics& s = result.statistics;
  std::printf("from scratch %.1f ms\n", result.from_scratch.mean());
  std::printf("cells %lld, carved %lld, ray-cell pairs %lld (at most %lld in a cell)\n",
              static_cast<long long>(s.cells), static_cast<long long>(s.carved_cells),
              static_cast<long long>(s.ray_cell_pairs),
              static_cast<long long>(s.max_constraints_in_cell));
  std::printf("vertices %lld, keyframes %lld, constraints %lld, ignored %lld, rebuilds %lld\n",
              static_cast<long long>(s.vertices), static_cast<long long>(s.keyframes),
              static_cast<long long>(s.constraints), static_cast<long long>(s.ignored_inputs),
              static_cast<long long>(s.rebuilds));
  std::printf("memory: carver's estimate %.1f MB, peak growth %.1f MB\n",
              static_cast<double>(s.memory_bytes) / 1048576.0, result.peak_memory_mb);
}

bool write_json(const Result& result, const std::string& path) {
  std::ofstream out(path);
  out << "{\n";
  for (size_t kind = 0; kind < 3; ++kind) {
    const Times& t = result.events[kind];
    if (t.ms.empty()) continue;
    out << "  \"" << kKindNames[kind] << "_ms\": {\"mean\": " << t.mean()
        << ", \"p95\": " << t.quantile(0.95) << ", \"max\": " << t.quantile(1.0)
        << ", \"events\": " << t.ms.size() << "},\n";
  }
  const CarverStatistics& s = result.statistics;
  out << "  \"from_scratch_ms\": " << result.from_scratch.mean() << ",\n  \"cells\": " << s.cells
      << ",\n  \"carved_cells\": " << s.carved_cells
      << ",\n  \"ray_cell_pairs\": " << s.ray_cell_pairs
      << ",\n  \"memory_estimate_bytes\": " << s.memory_bytes
      << ",\n  \"peak_growth_mb\": " << result.peak_memory_mb << "\n}\n";
  return static_cast<bool>(out);
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app{"Times free-space carving on a carvseq file"};
  app.add_option("input", arguments.input, "NAME.carv.gz")->required();
  app.add_flag("--reference-setup", arguments.reference_setup,
               "hull of ±20 m, earlier observations of new points not carved, exact coordinates");
  app.add_option("--json", arguments.json, "write the results to this file");
  app.add_option("--repeat", arguments.repeat, "runs to average over")->check(CLI::PositiveNumber);
  app.add_option("--max-constraints", arguments.max_constraints, "per cell; 0 = all")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--rebuild-cost-ratio", arguments.rebuild_cost_ratio,
                 "rebuild when an update seems this many times dearer")
      ->check(CLI::NonNegativeNumber);
  CLI11_PARSE(app, argc, argv);

  foresight::CarvReadOptions reading;
  CarverOptions options;
  options.max_constraints_per_cell = arguments.max_constraints;
  options.rebuild_cost_ratio = arguments.rebuild_cost_ratio;
  if (arguments.reference_setup) {
    reading.earlier_observations = false;
    reading.mu_per_m = 1e5;
    options.hull_half_size_mu = 20.0 * reading.mu_per_m;
  }
  const CarvSequence sequence = foresight::read_carv(arguments.input, reading);
  if (!sequence.error.empty()) {
    std::fprintf(stderr, "%s\n", sequence.error.c_str());
    return 64;
  }
  const Result result = run(sequence, options, arguments.repeat);
  print(result);
  if (arguments.json.empty() || write_json(result, arguments.json)) return 0;
  std::fprintf(stderr, "%s: cannot be written\n", arguments.json.c_str());
  return 64;
}
