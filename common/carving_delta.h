// What changed in the carved Delaunay tetrahedralisation: the core type behind carving_delta_t
// (carver → mesher). A snapshot is a delta that is applied to an empty carving.
// Order of application: cells_removed, vertices_removed, vertices_set, cells_added, cells_updated,
// vertices_updated.
// After each delta the cells tile the convex hull of the vertices: every facet has one or two
// cells.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace foresight {

/// What a vertex rests on: the segments that end at it, and the angle between the two of them that
/// differ most (0…π; their chord up to 12 % too short). One segment, or none, says nothing of its
/// depth.
struct VertexEvidence {
  int32_t observations = 0;
  float spread_rad = 0;
  bool operator==(const VertexEvidence&) const = default;
};

/// A vertex; `id` ≥ 0 is the map point of that id, `id` < 0 a corner of the bounding hull (−1…−8),
/// which lies far outside the scene and is no evidence of a surface.
struct CarvingVertex {
  int32_t id = 0;
  Eigen::Vector3f position_in_map = Eigen::Vector3f::Zero();
  VertexEvidence evidence = {};
};

/// What the segments say of one cell, as whole numbers: they add up the same in any order.
/// Facet k lies opposite vertex k.
struct CellVotes {
  std::array<int32_t, 4> entered{};  // segments that enter the cell through facet k
  int32_t started = 0;               // whose camera is in it, or on its border and looks into it
  int32_t ended = 0;  // whose point is one of its vertices, and that would go on into it: surface
  bool operator==(const CellVotes&) const = default;
};

/// A finite tetrahedron. `id` is a dense array index: ids of removed cells are reused.
/// `vertices` are positively oriented: det[v1−v0, v2−v0, v3−v0] > 0.
/// `constraints` is the number of free-space constraints (camera–point segments) known to cross its
/// interior; it is carved when that is not zero. (Those that come in through an edge or a vertex
/// are neither among `entered` nor `started`.)
struct CarvingCell {
  int32_t id = 0;
  std::array<int32_t, 4> vertices{};
  int32_t constraints = 0;
  CellVotes votes = {};
  bool carved() const { return constraints > 0; }
};

/// A new constraint count, new votes of an existing cell.
struct CarvingCellUpdate {
  int32_t id = 0;
  int32_t constraints = 0;
  CellVotes votes = {};
};

/// New evidence of a vertex that stays where it is.
struct CarvingVertexUpdate {
  int32_t id = 0;
  VertexEvidence evidence = {};
};

struct CarvingDelta {
  std::vector<int32_t> cells_removed;
  std::vector<int32_t> vertices_removed;
  std::vector<CarvingVertex> vertices_set;  // new ones, or moved ones whose cells are all replaced
  std::vector<CarvingCell> cells_added;
  std::vector<CarvingCellUpdate> cells_updated;
  std::vector<CarvingVertexUpdate> vertices_updated;

  bool empty() const {
    return cells_removed.empty() && vertices_removed.empty() && vertices_set.empty() &&
           cells_added.empty() && cells_updated.empty() && vertices_updated.empty();
  }
};

}  // namespace foresight
