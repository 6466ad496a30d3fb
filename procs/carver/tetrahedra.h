// The triangulation as plain arrays, which is what constraints walk through: 32 bytes per cell; and
// the names of places in the carver's arrays. A CellId crosses the border, an …Index never does.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/carving_delta.h"
#include "common/id.h"

namespace foresight::carving {

using Point3 = std::array<double, 3>;  // map units

/// 0…7 are the hull's corners.
using VertexIndex = Id<struct CarverVertexTag>;
/// Of map_state.h's records.
using PointIndex = Id<struct CarverPointTag>;
using KeyframeIndex = Id<struct CarverKeyframeTag>;
using ConstraintIndex = Id<struct CarverConstraintTag>;

inline constexpr VertexIndex kFirstPoint{VertexId::kHullCorners};

/// A finite cell: positively oriented vertices; neighbors[i] is opposite vertices[i], none =
/// outside.
struct Cell {
  std::array<VertexIndex, 4> vertices{};
  std::array<CellId, 4> neighbors{};
};

/// kNew and kDestroyed are relative to the delta that is being applied.
enum class CellState : uint8_t { kFree, kKept, kNew, kDestroyed };

struct Tetrahedra {
  IdVector<CellId, Cell> cells;
  IdVector<CellId, CellState> states;
  IdVector<VertexIndex, Point3> positions;
};

/// A place: the relative interior of the face of `cell` that the vertices in `mask` span
/// (15 = the cell's interior, one bit = a vertex).
struct Feature {
  CellId cell;
  uint32_t mask = 0;
};

/// Facet i as seen by a line that leaves the cell through it: counter-clockwise from outside.
inline constexpr int kFacetVertices[4][3] = {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}};

template <class IdType>
int index_of(const std::array<IdType, 4>& four, IdType value) {
  return four[0] == value ? 0 : four[1] == value ? 1 : four[2] == value ? 2 : 3;
}
template <class IdType>
bool contains(const std::array<IdType, 4>& four, IdType value) {
  return four[0] == value || four[1] == value || four[2] == value || four[3] == value;
}

/// Exact sign of det[b−a, c−a, d−a].
int orientation_sign(const Point3& a, const Point3& b, const Point3& c, const Point3& d);
/// Exact sign of the barycentric coordinate of `point` at the cell's i-th vertex.
int barycentric_sign(const Tetrahedra& tetrahedra, const Cell& cell, int i, const Point3& point);
/// Where a point strictly inside the hull lies; walks from the cell `hint`.
Feature locate(const Tetrahedra& tetrahedra, const Point3& point, CellId hint);

}  // namespace foresight::carving
