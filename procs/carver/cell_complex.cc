#include "procs/carver/cell_complex.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include "common/check.h"

namespace foresight::carving {

int orientation_sign(const Point3& a, const Point3& b, const Point3& c, const Point3& d) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  const auto point = [](const Point3& p) { return Kernel::Point_3(p[0], p[1], p[2]); };
  return static_cast<int>(CGAL::orientation(point(a), point(b), point(c), point(d)));
}

int barycentric_sign(const CellComplex& complex, const Cell& cell, int i, const Point3& point) {
  std::array<const Point3*, 4> corners{};
  for (size_t k = 0; k < 4; ++k) {
    corners[k] = &complex.positions[static_cast<size_t>(cell.vertices[k])];
  }
  corners[static_cast<size_t>(i)] = &point;
  return orientation_sign(*corners[0], *corners[1], *corners[2], *corners[3]);
}

// The visibility walk ends in any Delaunay triangulation: cells are ordered by power distance.
Feature locate(const CellComplex& complex, const Point3& point, int32_t hint) {
  int32_t current = hint;
  int32_t previous = -1;
  for (size_t steps = 0; steps <= complex.cells.size(); ++steps) {
    const Cell& cell = complex.cells[static_cast<size_t>(current)];
    uint8_t mask = 0;
    int32_t next = -1;
    for (int i = 0; i < 4 && next < 0; ++i) {
      const int32_t neighbor = cell.neighbors[static_cast<size_t>(i)];
      if (neighbor >= 0 && neighbor == previous) {
        mask = static_cast<uint8_t>(mask | 1U << i);  // we came from there: strictly inside
        continue;
      }
      const int sign = barycentric_sign(complex, cell, i, point);
      if (sign < 0) next = neighbor;
      if (sign < 0) FORESIGHT_CHECK(neighbor >= 0);
      if (sign > 0) mask = static_cast<uint8_t>(mask | 1U << i);
    }
    if (next < 0) return {current, mask};
    previous = current;
    current = next;
  }
  FORESIGHT_CHECK(!"locate ends");
}

}  // namespace foresight::carving
