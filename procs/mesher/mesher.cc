#include "procs/mesher/mesher.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/check.h"
#include "procs/mesher/smoothing.h"

namespace foresight {
namespace {

double median(std::vector<double>* values) {
  const auto middle = values->begin() + values->size() / 2;
  std::nth_element(values->begin(), middle, values->end());
  return *middle;
}

}  // namespace

Mesher::Mesher(const MesherOptions& options) : options_(options), visibility_(options.visibility) {
  FORESIGHT_CHECK(std::isfinite(options.lambda) && options.lambda >= 0);
  FORESIGHT_CHECK(options.min_constraints >= 1);
  const VisibilityWeights& w = options.visibility;
  for (const double weight : {w.surface, w.shape, w.pocket}) {
    FORESIGHT_CHECK(std::isfinite(weight) && weight >= 0 && weight <= kMaxVisibilityWeight);
  }
}

void Mesher::reset() {
  complex_.reset();
  visibility_.reset();
  carved_.clear();
  statistics_ = {};
}

Mesh Mesher::update() {
  statistics_ = {};
  statistics_.cells = complex_.cell_count();
  statistics_.hull_facets = complex_.hull_facet_count();
  switch (options_.energy) {
    case Energy::kVisibility:
      visibility_.update(&complex_, &flow_);
      break;
    case Energy::kVolume:
      statistics_.scene_size_mu = scene_size();
      statistics_.lambda_mu =
          options_.lambda *
          (options_.lambda_unit == LambdaUnit::kRelative ? statistics_.scene_size_mu : 1.0);
      weigh_by_volume(complex_, statistics_.lambda_mu, options_.min_constraints, &flow_);
      break;
  }
  flow_.solve();
  statistics_.decided_at_once = flow_.decided_at_once();
  read_labels();
  measure_energy();
  Isosurface surface = extract_isosurface(complex_, carved_, options_.repair);
  statistics_.split_vertices = surface.split_vertices;
  statistics_.split_edges = surface.split_edges;
  statistics_.smoothing_moves = smooth(complex_, options_.smoothing_passes, &surface.mesh);
  return std::move(surface.mesh);
}

/// The median distance of the map points from their component-wise median: unmoved by a minority of
/// outliers, by the far hull corners and by how densely a scene is sampled.
double Mesher::scene_size() const {
  std::array<std::vector<double>, 3> axes;
  for (const VertexIndex i : complex_.vertices()) {
    if (!complex_.exists_vertex(i) || !complex_.vertex_id(i).is_point()) continue;
    if (complex_.vertex_degree(i) == 0) continue;
    const Eigen::Vector3f& p = complex_.position_in_map(i);
    for (size_t k = 0; k < 3; ++k) axes[k].push_back(static_cast<double>(p[static_cast<int>(k)]));
  }
  if (axes[0].empty()) return 0;
  std::array<std::vector<double>, 3> sorted = axes;
  const Eigen::Vector3d centre(median(&sorted[0]), median(&sorted[1]), median(&sorted[2]));
  std::vector<double> distances(axes[0].size());
  for (size_t i = 0; i < distances.size(); ++i) {
    distances[i] = (Eigen::Vector3d(axes[0][i], axes[1][i], axes[2][i]) - centre).norm();
  }
  return median(&distances);
}

void Mesher::read_labels() {
  carved_.assign(complex_.cell_limit().index(), 0);
  for (const CellId cell : complex_.cells()) {
    if (!complex_.exists(cell)) continue;
    carved_[cell] = flow_.side(node_of(cell)) == MaxFlow::Side::kSource;
  }
}

void Mesher::measure_energy() {
  CutStatistics& s = statistics_;
  for (const CellId cell : complex_.cells()) {
    if (!complex_.exists(cell)) continue;
    const bool carved = carved_[cell] != 0;
    s.carved_cells += carved;
    s.input_carved_cells += input_carved(cell);
    if (carved != input_carved(cell)) {
      ++s.changed_cells;
      s.changed_volume_mu3 += complex_.volume(cell);
    }
    if (!carved) continue;
    for (const Slot slot : slots_of(cell)) {
      const Slot twin = complex_.twin(slot);
      const bool boundary = !twin.is_valid() || carved_[cell_of(twin)] == 0;
      if (boundary) s.surface_area_mu2 += complex_.area(slot);
    }
  }
  s.energy_mu3 = s.changed_volume_mu3 + s.lambda_mu * s.surface_area_mu2;
}

}  // namespace foresight
