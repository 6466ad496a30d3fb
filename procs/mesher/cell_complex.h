// The carved tetrahedralisation as dense arrays with neighbours: what CarvingDelta's add up to.
//
// A cell is a dense index, its facet k (0…3) lies opposite its vertex k, and "slot" 4·cell + k
// names both the vertex and the facet. twin(slot) is the same facet seen from the cell behind it;
// the complex is thus directly the 4-connected graph that MaxFlow cuts.
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
#include "procs/mesher/apply_result.h"
#include "procs/mesher/facet_table.h"
#include "procs/mesher/vertex_index.h"

namespace foresight {

class CellComplex {
 public:
  static constexpr int32_t kMaxVotes = 1 << 24;  // per cell: the flow adds them up

  [[nodiscard]] ApplyResult apply(const CarvingDelta& delta);
  void reset();

  /// One more than the largest cell index in use so far; there may be gaps.
  int32_t cell_limit() const { return static_cast<int32_t>(constraints_.size()); }
  int32_t cell_count() const { return cell_count_; }
  int32_t vertex_count() const { return vertex_indices_.size(); }
  /// Facets with one cell only: the hull. Twelve for a cube of corners.
  int32_t hull_facet_count() const { return 2 * facet_count_ - 4 * cell_count_; }

  bool exists(int32_t cell) const { return constraints_[index(cell)] >= 0; }
  int32_t constraints(int32_t cell) const { return constraints_[index(cell)]; }
  /// What the constraints say of the cell; CellVotes::entered by the facet's place in the cell.
  const CellVotes& votes(int32_t cell) const { return votes_[index(cell)]; }
  double volume(int32_t cell) const { return volumes_[index(cell)]; }  // mu³, ≥ 0

  /// The facet from the other side, or −1 on the hull.
  int32_t twin(int32_t slot) const { return twins_[index(slot)]; }
  /// In mu², equal to the last bit from both sides. Computed anew each time.
  double area(int32_t slot) const;
  /// A dense index of the vertex in `slot`.
  int32_t vertex(int32_t slot) const { return vertices_[index(slot)]; }

  /// Vertex indices have gaps, too: exists_vertex() tells.
  int32_t vertex_limit() const { return static_cast<int32_t>(points_.size()); }
  bool exists_vertex(int32_t vertex) const { return points_[index(vertex)].exists; }
  /// The vertex of this id, or −1.
  int32_t find_vertex(VertexId id) const { return vertex_indices_.find(id); }
  VertexId vertex_id(int32_t vertex) const { return points_[index(vertex)].id; }
  int32_t vertex_degree(int32_t vertex) const { return points_[index(vertex)].degree; }
  const Eigen::Vector3f& position_in_map(int32_t vertex) const {
    return points_[index(vertex)].position_in_map;
  }
  const VertexEvidence& evidence(int32_t vertex) const { return points_[index(vertex)].evidence; }

  /// Cells that came, went or have other votes since the last call (perhaps none the wiser), once
  /// each.
  std::vector<int32_t> take_touched();

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
  using Corners = std::array<int32_t, 4>;
  struct Evidence {
    int32_t constraints = 0;
    CellVotes votes;
    bool makes_sense() const;
  };
  /// What apply() did so far, to be undone from the end.
  struct Journal;

  static size_t index(int32_t i) { return static_cast<size_t>(i); }
  ApplyResult try_apply(const CarvingDelta& delta, Journal* journal);
  ApplyResult remove_cell(const CellId& id, Journal* journal);
  ApplyResult remove_vertex(const VertexId& id, Journal* journal);
  ApplyResult set_vertex(const CarvingVertex& vertex, Journal* journal);
  ApplyResult add_all_cells(const std::vector<CarvingCell>& cells);
  ApplyResult place_cell(const CarvingCell& cell);
  ApplyResult pair_all_facets(const std::vector<CarvingCell>& cells);
  void pair_facet(int32_t slot, int32_t twin);
  void remove_all_cells();
  void know_facets();
  ApplyResult add_cell(const CarvingCell& cell, Journal* journal);
  ApplyResult update_cell(const CarvingCellUpdate& update, Journal* journal);
  ApplyResult update_vertex(const CarvingVertexUpdate& update, Journal* journal);
  void resize_cells(size_t limit);
  void touch(int32_t cell);
  void commit(const Journal& journal);
  void roll_back(const Journal& journal);

  ApplyResult check_cell(const CarvingCell& cell, Corners* corners, double* volume) const;
  ApplyResult find_corners(const CarvingCell& cell, Corners* corners) const;
  ApplyResult attach(int32_t cell, const Corners& corners, const Evidence& evidence, double volume);
  void set_evidence(int32_t cell, const Evidence& evidence);
  void detach(int32_t cell);
  void clear_cell(int32_t cell);
  ApplyResult attach_facet(int32_t slot);
  void detach_facet(int32_t slot);
  FacetKey facet_key(int32_t slot) const;
  int32_t new_point();

  // By cell.
  std::vector<int32_t> constraints_;  // −1: no such cell
  std::vector<CellVotes> votes_;
  std::vector<double> volumes_;
  std::vector<uint8_t> is_touched_;
  std::vector<int32_t> touched_;
  // By slot.
  std::vector<int32_t> vertices_;
  std::vector<int32_t> twins_;
  // By vertex.
  std::vector<Point> points_;
  std::vector<int32_t> free_points_;
  VertexIndex vertex_indices_{VertexId::kHullCorners};

  FacetTable facets_;
  bool facets_known_ = true;  // not yet, after a whole complex was added
  int32_t facet_count_ = 0;
  int32_t cell_count_ = 0;
};

/// The vertices of facet k, counter-clockwise seen from outside a positively oriented cell.
inline constexpr std::array<std::array<int32_t, 3>, 4> kFacetCorners = {
    {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

}  // namespace foresight
