// carve-bench: times the cores of carver and mesher on a recorded map sequence, and writes the
// mesh. Times are CPU times of the thread: of `Carver::apply` per event; of `Mesher::apply` and
// `update` after it ("cut": from a delta to the mesh).
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <numeric>
#include <string>
#include <vector>

#include "bench/carve_bench/carv_reader.h"
#include "procs/carver/carver.h"
#include "procs/mesher/mesher.h"

namespace {

using foresight::Carver;
using foresight::CarverOptions;
using foresight::CarverStatistics;
using foresight::CarvingDelta;
using foresight::CarvSequence;
using foresight::MapDelta;
using foresight::Mesh;
using foresight::Mesher;
using foresight::MesherOptions;

struct Arguments {
  std::string input, json, mesh, energy = "visibility", lambda_unit = "relative";
  MesherOptions mesher;
  bool carver_only = false;
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
  Times cuts, cut_from_scratch;
  CarverStatistics statistics;
  foresight::CutStatistics cut;
  Mesh mesh;
  int64_t rebuilds = 0;
  double peak_memory_mb = 0.0;
};

constexpr std::array<const char*, 3> kKindNames{"keyframe", "deletion", "adjustment"};

double thread_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
}

double timed_apply(Carver& carver, const MapDelta& delta, CarvingDelta* result) {
  const double start = thread_ms();
  *result = carver.apply(delta);
  return thread_ms() - start;
}

double timed_update(Mesher& mesher, const CarvingDelta& delta, Mesh* mesh) {
  const double start = thread_ms();
  if (mesher.apply(delta) != foresight::ApplyResult::kOk) {
    std::fprintf(stderr, "the mesher rejects a delta of the carver\n");
    std::exit(1);
  }
  *mesh = mesher.update();
  return thread_ms() - start;
}

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

// The carver alone first: its memory is what grows meanwhile.
void time_carver(const CarvSequence& sequence, const CarverOptions& options, int repeat,
                 Result* result) {
  const double before_mb = peak_memory_mb();
  CarvingDelta delta;
  for (int n = 0; n < repeat; ++n) {
    Carver carver(options);
    for (const auto& event : sequence.events) {
      result->events[static_cast<size_t>(event.kind)].ms.push_back(
          timed_apply(carver, event.delta, &delta));
    }
    result->statistics = carver.statistics();
  }
  result->peak_memory_mb = peak_memory_mb() - before_mb;
  const MapDelta whole = foresight::final_map(sequence);
  for (int n = 0; n < repeat; ++n) {
    Carver carver(options);
    result->from_scratch.ms.push_back(timed_apply(carver, whole, &delta));
  }
}

void time_mesher(const CarvSequence& sequence, const CarverOptions& options,
                 const MesherOptions& mesher_options, int repeat, Result* result) {
  for (int n = 0; n < repeat; ++n) {
    Carver carver(options);
    Mesher mesher(mesher_options);
    for (const auto& event : sequence.events) {
      result->cuts.ms.push_back(timed_update(mesher, carver.apply(event.delta), &result->mesh));
    }
    result->cut = mesher.statistics();
    Mesher anew(mesher_options);
    Mesh mesh;
    result->cut_from_scratch.ms.push_back(timed_update(anew, carver.snapshot(), &mesh));
  }
}

// Without what only the hull's corners span: that is no surface that was seen.
bool write_obj(const Mesh& mesh, const std::string& path) {
  std::ofstream out(path);
  out.precision(9);
  for (const auto& v : mesh.vertices_in_map) {
    out << "v " << v.x() << " " << v.y() << " " << v.z() << "\n";
  }
  for (const auto& t : mesh.triangles) {
    const bool guessed = std::any_of(
        t.begin(), t.end(), [&](int32_t v) { return mesh.vertex_ids[static_cast<size_t>(v)] < 0; });
    if (!guessed) out << "f " << t[0] + 1 << " " << t[1] + 1 << " " << t[2] + 1 << "\n";
  }
  return static_cast<bool>(out);
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
  if (!result.cuts.ms.empty()) {
    std::printf("cut and mesh %6zu events  %.2f / %.2f / %.2f ms median / p95 / max\n",
                result.cuts.ms.size(), result.cuts.quantile(0.5), result.cuts.quantile(0.95),
                result.cuts.quantile(1.0));
    std::printf(
        "from scratch %.1f ms; %d of %d cells free, %zu triangles, split %d vertices, %d edges\n",
        result.cut_from_scratch.mean(), result.cut.carved_cells, result.cut.cells,
        result.mesh.triangles.size(), result.cut.split_vertices, result.cut.split_edges);
  }
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
    const std::string name = kKindNames[kind];
    out << "  \"" << name << "_ms_mean\": " << t.mean() << ",\n  \"" << name
        << "_ms_p95\": " << t.quantile(0.95) << ",\n  \"" << name
        << "_ms_max\": " << t.quantile(1.0) << ",\n  \"" << name << "_events\": " << t.ms.size()
        << ",\n";
  }
  if (!result.cuts.ms.empty()) {
    out << "  \"cut_ms_from_scratch\": " << result.cut_from_scratch.mean()
        << ",\n  \"cut_ms_incremental_median\": " << result.cuts.quantile(0.5)
        << ",\n  \"cut_ms_incremental_p95\": " << result.cuts.quantile(0.95)
        << ",\n  \"triangles\": " << result.mesh.triangles.size() << ",\n";
  }
  const CarverStatistics& s = result.statistics;
  out << "  \"from_scratch_ms\": " << result.from_scratch.mean() << ",\n  \"cells\": " << s.cells
      << ",\n  \"carved_cells\": " << s.carved_cells
      << ",\n  \"ray_cell_pairs\": " << s.ray_cell_pairs
      << ",\n  \"memory_estimate_mb\": " << static_cast<double>(s.memory_bytes) / 1048576.0
      << ",\n  \"peak_mb\": " << result.peak_memory_mb << "\n}\n";
  return static_cast<bool>(out);
}

void add_carver_options(Arguments* arguments, CLI::App* app) {
  app->add_option("input", arguments->input, "NAME.carv.gz")->required();
  app->add_flag("--reference-setup", arguments->reference_setup,
                "hull of ±20 m, earlier observations of new points not carved, exact coordinates");
  app->add_option("--json", arguments->json, "write the results to this file");
  app->add_option("--repeat", arguments->repeat, "runs to average over")
      ->check(CLI::PositiveNumber);
  app->add_option("--max-constraints", arguments->max_constraints, "per cell; 0 = all")
      ->check(CLI::NonNegativeNumber);
  app->add_option("--rebuild-cost-ratio", arguments->rebuild_cost_ratio,
                  "rebuild when an update seems this many times dearer")
      ->check(CLI::NonNegativeNumber);
}

void add_cut_options(Arguments* arguments, CLI::App* app) {
  app->add_option("--mesh", arguments->mesh, "write the final mesh to this OBJ file");
  app->add_flag("--no-cut", arguments->carver_only, "time the carver only");
  app->add_option("--energy", arguments->energy, "what the surface minimises")
      ->check(CLI::IsMember({"visibility", "volume"}))
      ->capture_default_str();
  app->add_option("--surface-weight", arguments->mesher.visibility.surface,
                  "visibility: see mesher")
      ->check(CLI::Range(0.0, foresight::kMaxVisibilityWeight))
      ->capture_default_str();
  app->add_option("--shape-weight", arguments->mesher.visibility.shape, "visibility: see mesher")
      ->check(CLI::Range(0.0, foresight::kMaxVisibilityWeight))
      ->capture_default_str();
  app->add_option("--pocket-weight", arguments->mesher.visibility.pocket, "visibility: see mesher")
      ->check(CLI::Range(0.0, foresight::kMaxVisibilityWeight))
      ->capture_default_str();
  app->add_option("--lambda", arguments->mesher.lambda, "volume: weight of the area")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app->add_option("--lambda-unit", arguments->lambda_unit,
                  "volume: shares of the scene's size, or map units")
      ->check(CLI::IsMember({"relative", "map_unit"}))
      ->capture_default_str();
}

void measure(const CarvSequence& sequence, const Arguments& arguments, CarverOptions options,
             Result* result) {
  options.max_constraints_per_cell = arguments.max_constraints;
  options.rebuild_cost_ratio = arguments.rebuild_cost_ratio;
  MesherOptions mesher = arguments.mesher;
  if (arguments.energy == "volume") mesher.energy = foresight::Energy::kVolume;
  if (arguments.lambda_unit == "map_unit") mesher.lambda_unit = foresight::LambdaUnit::kMapUnit;
  time_carver(sequence, options, arguments.repeat, result);
  if (!arguments.carver_only) {
    time_mesher(sequence, options, mesher, arguments.repeat, result);
  }
}

int fail(const std::string& why) {
  std::fprintf(stderr, "%s\n", why.c_str());
  return 64;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app{"Times free-space carving and the cut on a carvseq file"};
  add_carver_options(&arguments, &app);
  add_cut_options(&arguments, &app);
  CLI11_PARSE(app, argc, argv);
  if (arguments.carver_only && !arguments.mesh.empty()) {
    return fail("--mesh needs the cut: leave out --no-cut");
  }
  foresight::CarvReadOptions reading;
  CarverOptions options;
  if (arguments.reference_setup) {
    reading.earlier_observations = false;
    reading.mu_per_m = 1e5;
    options.hull_half_size_mu = 20.0 * reading.mu_per_m;
  }
  const CarvSequence sequence = foresight::read_carv(arguments.input, reading);
  if (!sequence.error.empty()) return fail(sequence.error);
  Result result;
  measure(sequence, arguments, options, &result);
  print(result);
  if (!arguments.json.empty() && !write_json(result, arguments.json)) {
    return fail(arguments.json + ": cannot be written");
  }
  if (!arguments.mesh.empty() && !write_obj(result.mesh, arguments.mesh)) {
    return fail(arguments.mesh + ": cannot be written");
  }
  return 0;
}
