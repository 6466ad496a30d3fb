#include "procs/mesher/smoothing.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <map>
#include <vector>

namespace foresight {
namespace {

using Eigen::Vector3d;
using Tetrahedron = std::array<Vector3d, 4>;

/// Whether the projections onto the axis have more than a point in common.
bool overlap_along(const Vector3d& axis, const Tetrahedron& a, const Tetrahedron& b) {
  const auto extent = [&](const Tetrahedron& t) {
    const auto [low, high] =
        std::minmax({axis.dot(t[0]), axis.dot(t[1]), axis.dot(t[2]), axis.dot(t[3])});
    return std::pair(low, high);
  };
  constexpr double kRounding = 1e-12;
  const auto [a_low, a_high] = extent(a);
  const auto [b_low, b_high] = extent(b);
  const double largest =
      std::max({std::abs(a_low), std::abs(a_high), std::abs(b_low), std::abs(b_high)});
  return std::min(a_high, b_high) - std::max(a_low, b_low) > kRounding * largest;
}

/// Separating axes: the faces' normals and the products of edges.
bool interiors_overlap(Tetrahedron a, Tetrahedron b) {
  const Vector3d origin = a[0];  // near the origin little is lost to rounding
  for (auto* t : {&a, &b}) {
    for (Vector3d& p : *t) p -= origin;
  }
  const auto edges = [](const Tetrahedron& t) {
    return std::array<Vector3d, 6>{t[1] - t[0], t[2] - t[0], t[3] - t[0],
                                   t[2] - t[1], t[3] - t[1], t[3] - t[2]};
  };
  const auto ea = edges(a), eb = edges(b);
  for (const auto* e : {&ea, &eb}) {
    for (const auto& [i, j] : {std::pair(0, 1), {0, 2}, {1, 2}, {3, 4}}) {
      const Vector3d normal = (*e)[i].cross((*e)[j]);
      if (!overlap_along(normal, a, b)) return false;
    }
  }
  for (const Vector3d& x : ea) {
    for (const Vector3d& y : eb) {
      const Vector3d axis = x.cross(y);
      if (axis.squaredNorm() > 1e-24 * x.squaredNorm() * y.squaredNorm() &&
          !overlap_along(axis, a, b)) {
        return false;
      }
    }
  }
  return true;
}

/// Strictly: on a border the next search would not know on which side to begin.
bool contains(const Tetrahedron& t, const Vector3d& p) {
  const auto volume = [](const Vector3d& a, const Vector3d& b, const Vector3d& c,
                         const Vector3d& d) { return (b - a).cross(c - a).dot(d - a); };
  return volume(p, t[1], t[2], t[3]) > 0 && volume(t[0], p, t[2], t[3]) > 0 &&
         volume(t[0], t[1], p, t[3]) > 0 && volume(t[0], t[1], t[2], p) > 0;
}

class Smoother {
 public:
  Smoother(const CellComplex& complex, Mesh* mesh) : complex_(complex), mesh_(*mesh) {
    find_rings();
    find_homes();
    seen_at_.assign(complex.cell_limit().index(), 0);
  }

  int32_t pass() {
    int32_t moved = 0;
    for (size_t v = 0; v < rings_.size(); ++v) {
      if (!homes_[v].empty()) moved += try_move(v);
    }
    return moved;
  }

 private:
  Vector3d position(size_t v) const { return mesh_.vertices_in_map[v].cast<double>(); }
  Tetrahedron corners(CellId cell) const {
    Tetrahedron t;
    for (int32_t k = 0; k < 4; ++k) {
      t[k] = complex_.position_in_map(complex_.vertex(slot_of(cell, k))).cast<double>();
    }
    return t;
  }

  void find_rings();
  void find_homes();
  bool try_move(size_t v);
  bool turns_over(size_t v, const Vector3d& to) const;
  bool sweeps_unseen(size_t v, const Tetrahedron& swept, const Vector3d& to);

  const CellComplex& complex_;
  Mesh& mesh_;
  std::vector<std::vector<std::array<size_t, 2>>> rings_;  // by vertex: the rest of its triangles
  std::vector<std::vector<CellId>> homes_;  // by vertex: cells at it; empty if it must stay
  IdVector<CellId, uint32_t> seen_at_;      // the last search that met it
  uint32_t search_ = 0;
  std::vector<CellId> queue_;
  CellId new_home_;
};

void Smoother::find_rings() {
  rings_.resize(mesh_.vertices_in_map.size());
  for (const auto& t : mesh_.triangles) {
    for (size_t j = 0; j < 3; ++j) {
      const size_t b = t[(j + 1) % 3], c = t[(j + 2) % 3];
      rings_[t[j]].push_back({b, c});
    }
  }
}

void Smoother::find_homes() {
  homes_.resize(rings_.size());
  std::map<VertexId, int32_t> sheets;
  for (const VertexId id : mesh_.vertex_ids) ++sheets[id];
  IdVector<VertexIndex, int32_t> vertex_by_point(complex_.vertex_limit().index(), -1);
  for (size_t v = 0; v < rings_.size(); ++v) {
    const bool at_hull = std::any_of(rings_[v].begin(), rings_[v].end(), [&](const auto& edge) {
      return !mesh_.vertex_ids[edge[0]].is_point() || !mesh_.vertex_ids[edge[1]].is_point();
    });
    const VertexId id = mesh_.vertex_ids[v];
    if (!id.is_point() || at_hull || sheets[id] > 1) continue;
    vertex_by_point[complex_.find_vertex(id)] = static_cast<int32_t>(v);
  }
  for (const Slot slot : complex_.slots()) {
    if (!complex_.exists(cell_of(slot))) continue;
    const int32_t v = vertex_by_point[complex_.vertex(slot)];
    if (v >= 0) homes_[v].push_back(cell_of(slot));
  }
}

// Where it goes is rounded to float first: what is tested is what will be there.
bool Smoother::try_move(size_t v) {
  Vector3d middle = Vector3d::Zero();
  for (const auto& edge : rings_[v]) middle += position(edge[0]);
  middle /= static_cast<double>(rings_[v].size());
  const Eigen::Vector3f target = ((position(v) + middle) / 2).cast<float>();
  const Vector3d to = target.cast<double>();
  if (target == mesh_.vertices_in_map[v] || turns_over(v, to)) return false;
  new_home_ = CellId();
  for (const auto& [b, c] : rings_[v]) {
    if (!sweeps_unseen(v, {position(v), position(b), position(c), to}, to)) return false;
  }
  if (!new_home_.is_valid()) return false;
  homes_[v] = {new_home_};
  mesh_.vertices_in_map[v] = target;
  return true;
}

bool Smoother::turns_over(size_t v, const Vector3d& to) const {
  return std::any_of(rings_[v].begin(), rings_[v].end(), [&](const auto& edge) {
    const Vector3d b = position(edge[0]), c = position(edge[1]);
    const Vector3d before = (b - position(v)).cross(c - position(v));
    return before.dot((b - to).cross(c - to)) <= 0;
  });
}

// Goes from the cells at the vertex through all that the swept tetrahedron overlaps.
bool Smoother::sweeps_unseen(size_t v, const Tetrahedron& swept, const Vector3d& to) {
  ++search_;
  queue_ = homes_[v];
  for (const CellId cell : queue_) seen_at_[cell] = search_;
  for (size_t n = 0; n < queue_.size(); ++n) {
    const CellId cell = queue_[n];
    const Tetrahedron tetrahedron = corners(cell);
    if (complex_.constraints(cell) == 0 && contains(tetrahedron, to)) new_home_ = cell;
    if (!interiors_overlap(swept, tetrahedron)) continue;
    if (complex_.constraints(cell) > 0) return false;
    for (const Slot slot : slots_of(cell)) {
      const Slot twin = complex_.twin(slot);
      if (!twin.is_valid()) continue;
      const CellId next = cell_of(twin);
      if (seen_at_[next] == search_) continue;
      seen_at_[next] = search_;
      queue_.push_back(next);
    }
  }
  return true;
}

}  // namespace

int32_t smooth(const CellComplex& complex, int32_t passes, Mesh* mesh) {
  if (passes <= 0) return 0;
  Smoother smoother(complex, mesh);
  int32_t moved = 0;
  for (int32_t n = 0; n < passes; ++n) moved += smoother.pass();
  return moved;
}

}  // namespace foresight
