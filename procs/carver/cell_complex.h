// The triangulation as plain arrays, which is what rays walk through: 32 bytes per cell.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace foresight::carving {

using Point3 = std::array<double, 3>;  // map units

inline constexpr int32_t kHullCorners = 8;  // vertices 0…7

/// A finite cell: positively oriented vertices; neighbors[i] is opposite vertices[i], −1 = outside.
struct Cell {
  std::array<int32_t, 4> vertices{};
  std::array<int32_t, 4> neighbors{};
};

/// kNew and kDestroyed are relative to the delta that is being applied.
enum class CellState : uint8_t { kFree, kKept, kNew, kDestroyed };

struct CellComplex {
  std::vector<Cell> cells;
  std::vector<CellState> states;  // by cell
  std::vector<Point3> positions;  // by vertex
};

/// A place: the relative interior of the face of `cell` that the vertices in `mask` span
/// (15 = the cell's interior, one bit = a vertex).
struct Feature {
  int32_t cell = -1;
  uint8_t mask = 0;
};

/// Facet i as seen by a line that leaves the cell through it: counter-clockwise from outside.
inline constexpr int kFacetVertices[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

inline int index_of(const std::array<int32_t, 4>& four, int32_t value) {
  return four[0] == value ? 0 : four[1] == value ? 1 : four[2] == value ? 2 : 3;
}
inline bool contains(const std::array<int32_t, 4>& four, int32_t value) {
  return four[0] == value || four[1] == value || four[2] == value || four[3] == value;
}

/// Exact sign of det[b−a, c−a, d−a].
int orientation_sign(const Point3& a, const Point3& b, const Point3& c, const Point3& d);
/// Exact sign of the barycentric coordinate of `point` at the cell's i-th vertex.
int barycentric_sign(const CellComplex& complex, const Cell& cell, int i, const Point3& point);
/// Where a point strictly inside the hull lies; walks from the cell `hint`.
Feature locate(const CellComplex& complex, const Point3& point, int32_t hint);

}  // namespace foresight::carving
