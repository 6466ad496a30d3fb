#include "procs/carver/tetrahedra.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include "common/check.h"

namespace foresight::carving {

int orientation_sign(const Point3& a, const Point3& b, const Point3& c, const Point3& d) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  const auto point = [](const Point3& p) { return Kernel::Point_3(p[0], p[1], p[2]); };
  return CGAL::orientation(point(a), point(b), point(c), point(d));
}

int barycentric_sign(const Tetrahedra& tetrahedra, const Cell& cell, int i, const Point3& point) {
  std::array<const Point3*, 4> corners{};
  for (size_t k = 0; k < 4; ++k) {
    corners[k] = &tetrahedra.positions[cell.vertices[k]];
  }
  corners[i] = &point;
  return orientation_sign(*corners[0], *corners[1], *corners[2], *corners[3]);
}

// The visibility walk ends in any Delaunay triangulation: cells are ordered by power distance.
Feature locate(const Tetrahedra& tetrahedra, const Point3& point, CellId hint) {
  CellId current = hint;
  CellId previous;
  for (size_t steps = 0; steps <= tetrahedra.cells.size(); ++steps) {
    const Cell& cell = tetrahedra.cells[current];
    uint32_t mask = 0;
    CellId next;
    for (int i = 0; i < 4 && !next.is_valid(); ++i) {
      const CellId neighbor = cell.neighbors[i];
      if (neighbor.is_valid() && neighbor == previous) {
        mask |= 1U << i;  // we came from there: strictly inside
        continue;
      }
      const int sign = barycentric_sign(tetrahedra, cell, i, point);
      if (sign < 0) next = neighbor;
      if (sign < 0) FORESIGHT_CHECK(neighbor.is_valid());
      if (sign > 0) mask |= 1U << i;
    }
    if (!next.is_valid()) return {current, mask};
    previous = current;
    current = next;
  }
  FORESIGHT_CHECK(!"locate ends");
}

}  // namespace foresight::carving
