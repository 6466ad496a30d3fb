// The carved tetrahedralisation as dense arrays with neighbours: what CarvingDelta's add up to.
//
// A cell is a dense index, its facet k (0…3) lies opposite its vertex k, and a Slot names both the
// vertex and the facet. twin(slot) is the same facet seen from the cell behind it; the complex is
// thus directly the 4-connected graph that MaxFlow cuts.
//
//   CellComplex complex;
//   if (complex.apply(delta) != ApplyResult::kOk) request_snapshot();
//
// apply() is a transaction: a delta that does not fit leaves the complex as it was. It costs
// O(size of the delta), plus growing arrays; memory is bounded by what the deltas really carried.
// Positions and volumes are in map units.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "common/carving_delta.h"
#include "common/id.h"
#include "procs/mesher/apply_result.h"
#include "procs/mesher/facet_table.h"
#include "procs/mesher/vertex_table.h"

namespace foresight {

class CellComplex {
 public:
  static constexpr int32_t kMaxVotes = 1 << 24;  // per cell: the flow adds them up

  [[nodiscard]] ApplyResult apply(const CarvingDelta& delta);
  void reset();

  /// One beyond the largest cell in use so far; there may be gaps.
  CellId cell_limit() const { return constraints_.limit(); }
  /// All below the limit; exists() tells which are there.
  IdRange<CellId> cells() const { return constraints_.ids(); }
  IdRange<Slot> slots() const { return vertices_.ids(); }
  int32_t cell_count() const { return cell_count_; }
  int32_t vertex_count() const { return vertex_table_.size(); }
  /// Facets with one cell only: the hull. Twelve for a cube of corners.
  int32_t hull_facet_count() const { return 2 * facet_count_ - 4 * cell_count_; }

  bool exists(CellId cell) const { return constraints_[cell] >= 0; }
  int32_t constraints(CellId cell) const { return constraints_[cell]; }
  /// What the constraints say of the cell; CellVotes::entered by the facet's place in the cell.
  const CellVotes& votes(CellId cell) const { return votes_[cell]; }
  double volume(CellId cell) const { return volumes_[cell]; }  // mu³, ≥ 0

  /// The facet from the other side, or none on the hull.
  Slot twin(Slot slot) const { return twins_[slot]; }
  /// In mu², equal to the last bit from both sides. Computed anew each time.
  double area(Slot slot) const;
  VertexIndex vertex(Slot slot) const { return vertices_[slot]; }

  /// Vertices have gaps, too: exists_vertex() tells.
  VertexIndex vertex_limit() const { return points_.limit(); }
  IdRange<VertexIndex> vertices() const { return points_.ids(); }
  bool exists_vertex(VertexIndex vertex) const { return points_[vertex].exists; }
  /// The vertex of this id, or none.
  VertexIndex find_vertex(VertexId id) const { return vertex_table_.find(id); }
  VertexId vertex_id(VertexIndex vertex) const { return points_[vertex].id; }
  int32_t vertex_degree(VertexIndex vertex) const { return points_[vertex].degree; }
  const Eigen::Vector3f& position_in_map(VertexIndex vertex) const {
    return points_[vertex].position_in_map;
  }
  const VertexEvidence& evidence(VertexIndex vertex) const { return points_[vertex].evidence; }

  /// Cells that came, went or have other votes since the last call (perhaps none the wiser), once
  /// each.
  std::vector<CellId> take_touched();

  /// Re-derives every invariant the slow way: nothing, or the first that is broken. For tests.
  std::optional<std::string_view> find_broken_invariant() const;

 private:
  struct Point {
    Eigen::Vector3f position_in_map = Eigen::Vector3f::Zero();
    VertexEvidence evidence;
    VertexId id;
    int32_t degree = 0;  // cells that use it
    bool exists = false;
  };
  using Corners = std::array<VertexIndex, 4>;
  struct Evidence {
    int32_t constraints = 0;
    CellVotes votes;
    bool makes_sense() const;
  };
  /// What apply() did so far, to be undone from the end.
  struct Journal;

  ApplyResult try_apply(const CarvingDelta& delta, Journal* journal);
  ApplyResult remove_cell(const CellId& id, Journal* journal);
  ApplyResult remove_vertex(const VertexId& id, Journal* journal);
  ApplyResult set_vertex(const CarvingVertex& vertex, Journal* journal);
  ApplyResult add_all_cells(const std::vector<CarvingCell>& cells);
  ApplyResult place_cell(const CarvingCell& cell);
  ApplyResult pair_all_facets(const std::vector<CarvingCell>& cells);
  void pair_facet(Slot slot, Slot twin);
  void remove_all_cells();
  void know_facets();
  ApplyResult add_cell(const CarvingCell& cell, Journal* journal);
  ApplyResult update_cell(const CarvingCellUpdate& update, Journal* journal);
  ApplyResult update_vertex(const CarvingVertexUpdate& update, Journal* journal);
  void resize_cells(size_t limit);
  void touch(CellId cell);
  void commit(const Journal& journal);
  void roll_back(const Journal& journal);

  ApplyResult check_cell(const CarvingCell& cell, Corners* corners, double* volume) const;
  ApplyResult find_corners(const CarvingCell& cell, Corners* corners) const;
  ApplyResult attach(CellId cell, const Corners& corners, const Evidence& evidence, double volume);
  void set_evidence(CellId cell, const Evidence& evidence);
  void detach(CellId cell);
  void clear_cell(CellId cell);
  ApplyResult attach_facet(Slot slot);
  void detach_facet(Slot slot);
  std::array<VertexIndex, 3> facet_vertices(Slot slot) const;
  FacetKey facet_key(Slot slot) const;
  VertexIndex new_point();

  IdVector<CellId, int32_t> constraints_;  // −1: no such cell
  IdVector<CellId, CellVotes> votes_;
  IdVector<CellId, double> volumes_;
  IdVector<CellId, uint8_t> is_touched_;
  std::vector<CellId> touched_;
  IdVector<Slot, VertexIndex> vertices_;
  IdVector<Slot, Slot> twins_;
  IdVector<VertexIndex, Point> points_;
  std::vector<VertexIndex> free_points_;
  VertexTable vertex_table_;

  FacetTable facets_;
  bool facets_known_ = true;  // not yet, after a whole complex was added
  int32_t facet_count_ = 0;
  int32_t cell_count_ = 0;
};

/// The vertices of facet k, counter-clockwise seen from outside a positively oriented cell.
inline constexpr std::array<std::array<int32_t, 3>, 4> kFacetCorners = {
    {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

}  // namespace foresight
