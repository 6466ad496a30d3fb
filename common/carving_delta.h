// What changed in the carved Delaunay tetrahedralisation: the core type behind carving_delta_t
// (carver → mesher). A snapshot is a delta that is applied to an empty carving.
// Order of application: cells_removed, vertices_removed, vertices_set, cells_added, cells_updated,
// vertices_updated.
// After each delta the cells tile the convex hull of the vertices: every facet has one or two
// cells.
#pragma once

#include <Eigen/Core>
#include <array>
#include <compare>
#include <cstdint>
#include <functional>
#include <ostream>
#include <type_traits>
#include <vector>

#include "common/id.h"

namespace foresight {

/// A cell, as the carver numbers it and whoever follows it does: dense, the id of a removed cell is
/// used again.
using CellId = Id<struct CellTag>;

/// What a vertex is called outside of a process's arrays: the map point there (of several, the one
/// with the smallest id) or a corner of the bounding hull, which lies far outside the scene and is
/// no evidence of a surface.
class VertexId {
 public:
  using Value = int32_t;
  static constexpr Value kHullCorners = 8;

  /// None: neither point nor corner.
  constexpr VertexId() = default;
  /// As messages have it: the point's id, or −1…−8. Not checked.
  constexpr explicit VertexId(Value value) : value_(value) {}
  constexpr explicit VertexId(PointId point) : value_(point.value()) {}
  /// `corner` 0…7.
  static constexpr VertexId hull_corner(Value corner) { return VertexId(-1 - corner); }

  constexpr Value value() const { return value_; }
  constexpr bool is_point() const { return value_ >= 0; }
  constexpr bool is_valid() const { return value_ >= -kHullCorners; }

  constexpr auto operator<=>(const VertexId&) const = default;
  friend std::ostream& operator<<(std::ostream& out, VertexId id) { return out << id.value_; }

 private:
  Value value_ = -kHullCorners - 1;
};

static_assert(sizeof(VertexId) == sizeof(int32_t) && std::is_trivially_copyable_v<VertexId>);

/// What a vertex rests on: the observations of it, and the angle between the two whose directions
/// differ most (0…π; their chord up to 12 % too short). One observation, or none, says nothing of
/// its depth.
struct VertexEvidence {
  int32_t observations = 0;
  float spread_rad = 0;
  bool operator==(const VertexEvidence&) const = default;
};

struct CarvingVertex {
  VertexId id;
  Eigen::Vector3f position_in_map = Eigen::Vector3f::Zero();
  VertexEvidence evidence = {};
};

/// What the constraints say of one cell, as whole numbers: they add up the same in any order.
/// Facet k lies opposite vertex k.
struct CellVotes {
  std::array<int32_t, 4> entered{};  // constraints that enter the cell through facet k
  int32_t started = 0;               // whose camera is in it, or on its border and looks into it
  int32_t ended = 0;  // whose point is one of its vertices, and that would go on into it: surface
  bool operator==(const CellVotes&) const = default;
};

/// A finite tetrahedron.
/// `vertices` are positively oriented: det[v1−v0, v2−v0, v3−v0] > 0.
/// `constraints` is the number of free-space constraints (segments from a camera to a point that it
/// saw) known to cross its interior; it is carved when that is not zero. (Those that come in
/// through an edge or a vertex are neither among `entered` nor `started`.)
struct CarvingCell {
  CellId id;
  std::array<VertexId, 4> vertices{};
  int32_t constraints = 0;
  CellVotes votes = {};
  bool carved() const { return constraints > 0; }
};

/// A new constraint count, new votes of an existing cell.
struct CarvingCellUpdate {
  CellId id;
  int32_t constraints = 0;
  CellVotes votes = {};
};

/// New evidence of a vertex that stays where it is.
struct CarvingVertexUpdate {
  VertexId id;
  VertexEvidence evidence = {};
};

struct CarvingDelta {
  std::vector<CellId> cells_removed;
  std::vector<VertexId> vertices_removed;
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

template <>
struct std::hash<foresight::VertexId> {
  size_t operator()(foresight::VertexId id) const noexcept {
    return std::hash<int32_t>()(id.value());
  }
};
