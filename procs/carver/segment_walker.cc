#include "procs/carver/segment_walker.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>

namespace foresight::carving {

void SegmentWalker::aim(const Point3& from, VertexIndex target, const Point3& to) {
  from_ = from;
  target_ = target;
  to_ = to;
  const Point3 d{to_[0] - from[0], to_[1] - from[1], to_[2] - from[2]};
  k_ = 0;
  for (size_t axis = 1; axis < 3; ++axis) {
    if (std::abs(d[axis]) > std::abs(d[k_])) k_ = axis;
  }
  i_ = (k_ + 1) % 3;
  j_ = (k_ + 2) % 3;
  const double dk = d[k_];
  empty_ = dk == 0.0;
  if (empty_) return;
  slope_i_ = d[i_] / dk;
  slope_j_ = d[j_] / dk;
  flip_ = dk > 0.0 ? 1.0 : -1.0;
}

int SegmentWalker::exact_side(VertexIndex a, VertexIndex b) const {
  if (a == target_ || b == target_) return 0;
  return orientation_sign(from_, to_, position(a), position(b));
}

bool SegmentWalker::holds_target(const Feature& face) const {
  const Cell& cell = cell_at(face.cell);
  for (size_t i = 0; i < 4; ++i) {
    if ((face.mask >> i & 1) != 0 && cell.vertices[i] == target_) return true;
  }
  return false;
}

// All cells that have the face `at`: they are connected through facets that contain it.
void SegmentWalker::collect_incident(const Feature& at) {
  const Cell& seed = cell_at(at.cell);
  const auto has_face = [&](const Cell& cell) {
    for (size_t i = 0; i < 4; ++i) {
      if ((at.mask >> i & 1) != 0 && !contains(cell.vertices, seed.vertices[i])) return false;
    }
    return true;
  };
  incident_.assign(1, at.cell);
  for (size_t n = 0; n < incident_.size(); ++n) {
    const Cell cell = cell_at(incident_[n]);
    for (const CellId neighbor : cell.neighbors) {
      if (!neighbor.is_valid() || !has_face(cell_at(neighbor))) continue;
      if (std::find(incident_.begin(), incident_.end(), neighbor) == incident_.end()) {
        incident_.push_back(neighbor);
      }
    }
  }
}

// The face whose relative interior the segment runs in just after `at`. Seen from a point inside a
// face, the direction to P has the barycentric signs of P at the vertices that are not in the face.
Feature SegmentWalker::carrier_from(const Feature& at) {
  if (at.mask == 15) return at;
  collect_incident(at);
  const Cell seed = cell_at(at.cell);
  for (const CellId id : incident_) {
    const Cell& cell = cell_at(id);
    uint32_t mask = 0;
    bool inside = true;
    for (int i = 0; i < 4 && inside; ++i) {
      const int in_seed = contains(seed.vertices, cell.vertices[i])
                              ? index_of(seed.vertices, cell.vertices[i])
                              : -1;
      const bool in_face = in_seed >= 0 && (at.mask >> in_seed & 1) != 0;
      const int sign = in_face ? 1 : barycentric_sign(tetrahedra_, cell, i, to_);
      inside = sign >= 0;
      if (sign > 0) mask |= 1U << i;
    }
    if (inside) return {id, mask};
  }
  FORESIGHT_CHECK(!"a face carries the segment on");
}

// The segment's line crosses the interior: where does it leave?
Feature SegmentWalker::exit_of_cell(CellId id) const {
  const Cell& cell = cell_at(id);
  std::array<Sheared, 4> corners;
  for (size_t i = 0; i < 4; ++i) corners[i] = shear(cell.vertices[i]);
  for (int facet = 0; facet < 4; ++facet) {
    unsigned mask = 15U ^ 1U << facet;
    int positive = 0, negative = 0;
    for (int n = 0; n < 3 && negative == 0; ++n) {
      const int a = kFacetVertices[facet][n], b = kFacetVertices[facet][(n + 1) % 3];
      const int sign = side(corners[a], corners[b]);
      positive += sign > 0;
      negative += sign < 0;
      if (sign == 0) mask &= 1U << a | 1U << b;
    }
    if (negative == 0 && positive > 0) return {id, mask};
  }
  FORESIGHT_CHECK(!"a line leaves the cell it crosses");
}

// The segment lies in the plane of an edge at the apex: it may meet that edge, or only its line.
int SegmentWalker::dropped_corner_in_plane(const std::array<Sheared, 3>& edge, CellId cell) const {
  const Feature exit = exit_of_cell(cell);
  if (__builtin_popcount(exit.mask) < 3) return -1;
  const VertexIndex behind = cell_at(cell).vertices[__builtin_ctz(15U ^ exit.mask)];
  return edge[0].vertex == behind ? 0 : edge[1].vertex == behind ? 1 : 2;
}

// The segment runs in the facet's plane. Seen from the cell's fourth vertex q, with the facet
// counter-clockwise, it leaves by the edge that goes from its right to its left.
Feature SegmentWalker::exit_of_facet(const Feature& facet) const {
  const Cell& cell = cell_at(facet.cell);
  const int q = __builtin_ctz(15U ^ facet.mask);
  const int* outward = kFacetVertices[q];
  const std::array<int, 3> ring{outward[0], outward[2], outward[1]};
  std::array<int, 3> left{};
  for (size_t n = 0; n < 3; ++n) {
    left[n] =
        -orientation_sign(from_, to_, position(cell.vertices[q]), position(cell.vertices[ring[n]]));
  }
  for (size_t n = 0; n < 3; ++n) {
    const size_t m = (n + 1) % 3;
    if (left[n] > 0 || left[m] < 0 || (left[n] == 0 && left[m] == 0)) continue;
    unsigned mask = 1U << ring[n] | 1U << ring[m];
    if (left[n] == 0) mask = 1U << ring[n];
    if (left[m] == 0) mask = 1U << ring[m];
    return {facet.cell, mask};
  }
  FORESIGHT_CHECK(!"a line leaves the facet it runs in");
}

// Does the line leave the cell by the facet opposite the target? If it misses it, `missed_edge` is
// one (from corner n to n + 1 of the facet) on whose other side it passes.
SegmentWalker::Exit SegmentWalker::exit_opposite_target(CellId id, size_t* missed_edge) const {
  const Cell& cell = cell_at(id);
  const int* corners = kFacetVertices[index_of(cell.vertices, target_)];
  std::array<Sheared, 3> sheared;
  for (size_t n = 0; n < 3; ++n) {
    sheared[n] = shear(cell.vertices[corners[n]]);
  }
  int positive = 0;
  for (size_t n = 0; n < 3; ++n) {
    const int sign = side(sheared[n], sheared[(n + 1) % 3]);
    if (sign < 0) {
      *missed_edge = n;
      return Exit::kMissed;
    }
    positive += sign > 0;
  }
  *missed_edge = 0;
  return positive == 3 ? Exit::kInside : positive > 0 ? Exit::kOnBorder : Exit::kMissed;
}

// Around the target from cell to cell towards where the segment goes; if that does not get there
// soon, or the answer is tied, every cell around is looked at.
SegmentWalker::Behind SegmentWalker::behind(CellId incident) {
  constexpr int kSoon = 24;
  CellId id = incident;
  for (int step = 0; step < kSoon; ++step) {
    size_t edge = 0;
    const Exit exit = exit_opposite_target(id, &edge);
    if (exit == Exit::kInside) return {id, false};
    if (exit == Exit::kOnBorder) break;
    const Cell& cell = cell_at(id);
    const int* corners = kFacetVertices[index_of(cell.vertices, target_)];
    id = cell.neighbors[corners[(edge + 2) % 3]];
  }
  collect_incident({incident, 1U << index_of(cell_at(incident).vertices, target_)});
  const auto sorted_corners = [&](CellId cell) {
    std::array<Point3, 4> corners;
    for (size_t i = 0; i < 4; ++i) corners[i] = position(cell_at(cell).vertices[i]);
    std::sort(corners.begin(), corners.end());
    return corners;
  };
  Behind best;
  for (const CellId cell : incident_) {
    size_t edge = 0;
    const Exit exit = exit_opposite_target(cell, &edge);
    if (exit == Exit::kInside) return {cell, false};
    if (exit == Exit::kMissed) continue;
    if (!best.cell.is_valid() || sorted_corners(cell) < sorted_corners(best.cell))
      best = {cell, true};
  }
  FORESIGHT_CHECK(best.cell.is_valid());
  return best;
}

// The segment runs along the edge: on to the end that lies ahead.
Feature SegmentWalker::exit_of_edge(const Feature& at, const Feature& edge) const {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  const auto point = [](const Point3& p) { return Kernel::Point_3(p[0], p[1], p[2]); };
  const Cell& cell = cell_at(edge.cell);
  const Cell& seed = cell_at(at.cell);
  for (size_t i = 0; i < 4; ++i) {
    if ((edge.mask >> i & 1) == 0) continue;
    const VertexIndex vertex = cell.vertices[i];
    const bool behind = __builtin_popcount(at.mask) == 1
                            ? vertex == seed.vertices[__builtin_ctz(at.mask)]
                            : !CGAL::collinear_are_ordered_along_line(
                                  point(from_), point(position(vertex)), point(to_));
    if (!behind) return {edge.cell, 1U << i};
  }
  FORESIGHT_CHECK(!"an edge has an end ahead");
}

}  // namespace foresight::carving
