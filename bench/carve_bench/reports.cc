#include "bench/carve_bench/reports.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <set>
#include <sstream>

#include "common/output_file.h"

namespace foresight {
namespace {

constexpr std::array<const char*, 3> kKindNames{"keyframe", "deletion", "adjustment"};

}  // namespace

void print(const CarveResult& result) {
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
  std::printf("cells %lld, carved %lld, constraint-cell pairs %lld (at most %lld in a cell)\n",
              static_cast<long long>(s.cells), static_cast<long long>(s.carved_cells),
              static_cast<long long>(s.constraint_cell_pairs),
              static_cast<long long>(s.max_constraints_in_cell));
  std::printf("vertices %lld, keyframes %lld, constraints %lld, ignored %lld, rebuilds %lld\n",
              static_cast<long long>(s.vertices), static_cast<long long>(s.keyframes),
              static_cast<long long>(s.constraints), static_cast<long long>(s.ignored_inputs),
              static_cast<long long>(s.rebuilds));
  std::printf("memory: carver's estimate %.1f MB, peak growth %.1f MB\n",
              static_cast<double>(s.memory_bytes) / 1048576.0, result.peak_memory_mb);
}

void write_json(const CarveResult& result, const std::string& path) {
  if (path.empty()) return;
  std::ostringstream out;
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
      << ",\n  \"constraint_cell_pairs\": " << s.constraint_cell_pairs
      << ",\n  \"memory_estimate_mb\": " << static_cast<double>(s.memory_bytes) / 1048576.0
      << ",\n  \"peak_mb\": " << result.peak_memory_mb << "\n}\n";
  write_output(path, out.str());
}

void write_events(const CarvSequence& sequence, const CarveResult& result,
                  const std::string& path) {
  if (path.empty()) return;
  std::ostringstream out;
  out << "kind,points,constraints_added,carve_ms,cut_ms\n";
  std::set<PointId> points;
  for (size_t i = 0; i < sequence.events.size(); ++i) {
    const MapDelta& delta = sequence.events[i].delta;
    for (const PointId id : delta.points_removed) points.erase(id);
    for (const MapPoint& point : delta.points_set) points.insert(point.id);
    out << kKindNames[static_cast<size_t>(sequence.events[i].kind)] << "," << points.size() << ","
        << delta.observations_added.size() << "," << result.carve_ms[i] << ","
        << (result.cut_ms.empty() ? 0.0 : result.cut_ms[i]) << "\n";
  }
  write_output(path, out.str());
}

void write_obj(const Mesh& mesh, const std::string& path) {
  if (path.empty()) return;
  std::ostringstream out;
  out.precision(9);
  for (const auto& v : mesh.vertices_in_map) {
    out << "v " << v.x() << " " << v.y() << " " << v.z() << "\n";
  }
  for (const auto& t : mesh.triangles) {
    const bool guessed = std::any_of(t.begin(), t.end(), [&](int32_t v) {
      return !mesh.vertex_ids[static_cast<size_t>(v)].is_point();
    });
    if (!guessed) out << "f " << t[0] + 1 << " " << t[1] + 1 << " " << t[2] + 1 << "\n";
  }
  write_output(path, out.str());
}

}  // namespace foresight
