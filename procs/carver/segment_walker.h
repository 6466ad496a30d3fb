// Walks a segment through the triangulation, exactly: visits the cells whose interior the open
// segment crosses, once each, in order, whatever it meets on the way.
//
// The usual step looks at one new vertex: it is sheared along the segment onto a plane (4 flops)
// and two signs of 2×2 determinants say which facet comes next. A sign that rounding could change
// is decided by the exact orientation predicate. Where the segment meets an edge or a vertex, or
// runs inside a facet, the general step (segment_walker.cc) takes over.
//
//   SegmentWalker walker(tetrahedra);
//   walker.aim(camera_centre, target_vertex, its_position);
//   bool degenerate = walker.trace(start, [&](CellId cell, uint32_t code) { …; return true; });
//
// Source: visibility walks along a line, e.g. Devillers, Pion, Teillaud, "Walking in a
// triangulation", 2002; the static error bound is derived in docs/algorithms/carving.md.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "common/check.h"
#include "procs/carver/tetrahedra.h"

namespace foresight::carving {

/// How a segment came into a cell: through facet 0…3, or otherwise.
inline constexpr uint32_t kEntryStart = 4;  // it starts here: holds the camera
inline constexpr uint32_t kEntryEnd = 5;    // it does not: it ends in front of it, at a vertex
inline constexpr uint32_t kCountedCodes = 6;
inline constexpr uint32_t kEntryOther = 6;  // through an edge or a vertex

enum class WalkEnd : uint8_t { kArrived, kStopped, kDegenerate };

class SegmentWalker {
 public:
  explicit SegmentWalker(const Tetrahedra& tetrahedra) : tetrahedra_(tetrahedra) {}

  /// The segment runs from `from` to `to`, the position of vertex `target`.
  void aim(const Point3& from, VertexIndex target, const Point3& to);

  /// From the camera on. `visit(cell, code)` returns false to stop. Returns whether the segment
  /// met an edge or vertex, ran in a facet, or started on one (before it stopped).
  template <class Visit>
  bool trace(const Feature& start, Visit&& visit);

  /// Whether the last `trace` ran along a facet or an edge: there it crosses no cell.
  bool grazed() const { return grazed_; }

  /// The cell that the segment would enter if it went on beyond its end. `tied`: it would run along
  /// a facet or an edge there; of the cells around, the one is named that comes first by its
  /// vertices' positions, so that the answer depends on nothing but the geometry.
  struct Behind {
    CellId cell;
    bool tied = false;
  };
  /// `incident` is any cell at the target; the segment has a length.
  Behind behind(CellId incident);

  /// From the cell that is entered strictly inside its facet `facet`. Stops, kDegenerate, at the
  /// first edge or vertex.
  template <class Visit>
  WalkEnd walk_from_facet(CellId cell, int facet, Visit&& visit) {
    CellId last = cell;
    return walk(cell, facet, last, visit);
  }

 private:
  struct Sheared {
    double x = 0, y = 0, size = 0;
    VertexIndex vertex;
  };

  Sheared shear(VertexIndex vertex) const;
  int side(const Sheared& a, const Sheared& b) const;
  int exact_side(VertexIndex a, VertexIndex b) const;
  int dropped_corner(const std::array<Sheared, 3>& edge, const Sheared& apex, CellId cell) const;
  int dropped_corner_in_plane(const std::array<Sheared, 3>& edge, CellId cell) const;
  const Cell& cell_at(CellId cell) const { return tetrahedra_.cells[cell]; }
  const Point3& position(VertexIndex vertex) const { return tetrahedra_.positions[vertex]; }

  template <class Visit>
  WalkEnd walk(CellId cell, int facet, CellId& last, Visit& visit);
  // The general step; `mask` as in Feature.
  Feature carrier_from(const Feature& at);
  Feature exit_of_cell(CellId cell) const;
  Feature exit_of_facet(const Feature& facet) const;
  Feature exit_of_edge(const Feature& at, const Feature& edge) const;
  bool holds_target(const Feature& face) const;
  void collect_incident(const Feature& at);
  enum class Exit : uint8_t { kMissed, kOnBorder, kInside };
  Exit exit_opposite_target(CellId cell, size_t* missed_edge) const;

  const Tetrahedra& tetrahedra_;
  Point3 from_{}, to_{};
  VertexIndex target_;
  bool grazed_ = false;
  bool empty_ = true;  // a segment of length zero carves nothing
  size_t i_ = 0, j_ = 1, k_ = 2;
  double slope_i_ = 0, slope_j_ = 0, flip_ = 1;
  std::vector<CellId> incident_;
};

inline SegmentWalker::Sheared SegmentWalker::shear(VertexIndex vertex) const {
  const Point3& p = position(vertex);
  const double wi = p[i_] - from_[i_], wj = p[j_] - from_[j_], wk = p[k_] - from_[k_];
  return {flip_ * (wi - slope_i_ * wk), wj - slope_j_ * wk,
          std::abs(wi) + std::abs(wj) + std::abs(wk), vertex};
}

// Sign of det[to−from, a−from, b−from].
inline int SegmentWalker::side(const Sheared& a, const Sheared& b) const {
  constexpr double kRelativeError = 0x1p-47;  // proven: 32 u = 2^-48
  constexpr double kUnderflow = 1e-290;
  const double det = a.x * b.y - a.y * b.x;
  const double bound = kRelativeError * a.size * b.size + kUnderflow;
  if (det > bound) return 1;
  if (det < -bound) return -1;
  return exact_side(a.vertex, b.vertex);
}

// Which corner of the facet the segment entered by is not a corner of the facet it leaves by; −1 if
// it leaves by an edge or vertex. `apex` is the cell's fourth vertex.
inline int SegmentWalker::dropped_corner(const std::array<Sheared, 3>& edge, const Sheared& apex,
                                         CellId cell) const {
  const int first = side(edge[0], apex);
  const int other = first == 0 ? 0 : side(edge[first > 0 ? 1 : 2], apex);
  if (other == 0) return dropped_corner_in_plane(edge, cell);
  if (first > 0 && other < 0) return 2;
  return first < 0 && other > 0 ? 1 : 0;
}

template <class Visit>
WalkEnd SegmentWalker::walk(CellId cell, int facet, CellId& last, Visit& visit) {
  const Cell* c = &cell_at(cell);
  std::array<Sheared, 3> edge;  // the facet; the segment enters on its negative side
  for (size_t n = 0; n < 3; ++n) {
    edge[n] = shear(c->vertices[kFacetVertices[facet][n]]);
  }
  for (;;) {
    if (!visit(cell, facet)) return WalkEnd::kStopped;
    const VertexIndex apex = c->vertices[facet];
    if (apex == target_) return WalkEnd::kArrived;
    const Sheared p = shear(apex);
    const int dropped = dropped_corner(edge, p, cell);
    if (dropped < 0) {
      last = cell;
      return WalkEnd::kDegenerate;
    }
    const int exit = index_of(c->vertices, edge[dropped].vertex);
    const CellId next = c->neighbors[exit];
    FORESIGHT_CHECK(next.is_valid());
    edge[dropped] = p;
    c = &cell_at(next);
    facet = index_of(c->neighbors, cell);
    cell = next;
  }
}

template <class Visit>
bool SegmentWalker::trace(const Feature& start, Visit&& visit) {
  grazed_ = false;
  if (empty_) return false;
  Feature at = start;
  uint32_t code = kEntryStart;
  bool degenerate = false;
  for (;;) {
    degenerate |= at.mask != 15;
    const Feature carrier = carrier_from(at);
    if (carrier.mask == 15 && !visit(carrier.cell, code)) return degenerate;
    const int vertices = __builtin_popcount(carrier.mask);
    grazed_ |= vertices < 4;
    if (holds_target(carrier)) return degenerate;
    code = kEntryOther;
    if (vertices < 4) {
      at = vertices == 3 ? exit_of_facet(carrier) : exit_of_edge(at, carrier);
      continue;
    }
    at = exit_of_cell(carrier.cell);
    if (__builtin_popcount(at.mask) < 3) continue;
    const CellId next = cell_at(at.cell).neighbors[__builtin_ctz(15U ^ at.mask)];
    FORESIGHT_CHECK(next.is_valid());
    CellId last = next;
    const WalkEnd end = walk(next, index_of(cell_at(next).neighbors, at.cell), last, visit);
    if (end != WalkEnd::kDegenerate) return degenerate;
    at = exit_of_cell(last);
  }
}

}  // namespace foresight::carving
