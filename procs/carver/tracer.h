// Keeps the cells' lists equal to "the constraints that cross the cell's interior" and "the
// constraints that would go on into the cell beyond their point" while the triangulation and the
// constraints change. The steps of one delta, in this order:
//
//   erase(retired)     old cells: find the cells that retired constraints cross
//   …                  the triangulation changes
//   relocate()         cameras whose cell is gone
//   retrace(change)    constraints of destroyed cells, inside the new cells only
//   prune()            take retired constraints out of the surviving cells found by `erase`
//   trace(issued)      new constraints
//   forget(retired)    constraints that memory is too short for
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "procs/carver/constraint_lists.h"
#include "procs/carver/delaunay.h"
#include "procs/carver/map_state.h"
#include "procs/carver/segment_walker.h"

namespace foresight::carving {

class Tracer {
 public:
  Tracer(MapState& map, const Tetrahedra& tetrahedra, int max_constraints_per_cell)
      : map_(map),
        tetrahedra_(tetrahedra),
        walker_(tetrahedra),
        limit_(std::max(0, max_constraints_per_cell)) {}

  void reset();
  void erase(std::span<const RetiredConstraint> retired);
  void relocate();
  void retrace(const TriangulationChange& change);
  void prune();
  void trace(const std::vector<ConstraintIndex>& constraints);
  void forget(std::span<const RetiredConstraint> retired);
  /// After a rebuild, before trace(): all cells are new.
  void note_all_cells();

  ConstraintLists& lists() { return lists_; }
  const ConstraintLists& lists() const { return lists_; }
  int64_t runs() const { return runs_; }  // of the last delta
  int64_t traced() const { return traced_; }
  void start_delta(const std::vector<RetiredConstraint>& retired);

 private:
  ConstraintRecord& constraint_at(ConstraintIndex constraint) {
    return map_.constraints[constraint];
  }
  CellState state_of(CellId cell) const { return tetrahedra_.states[cell]; }
  // A constraint to be taken up again where it enters the changed region.
  struct Run {
    ConstraintIndex constraint;
    RegionEntry resume;
  };

  const Feature& aim(ConstraintIndex constraint);
  void collect_runs(CellId destroyed, const std::array<RegionEntry, 4>& entries);
  void collect_special(ConstraintIndex constraint, uint32_t code);
  void run(const Run& run);
  void prefetch(size_t run) const;
  void retrace_start(ConstraintIndex constraint);
  void queue_whole(ConstraintIndex constraint);
  void queue_grazing();
  template <class Visit>
  void trace_whole(ConstraintIndex constraint, Visit&& visit);
  void retrace_whole(const TriangulationChange& change);
  void note_cell(CellId cell);
  void place_end(ConstraintIndex constraint);
  void retrace_ends();
  void add(CellId cell, ConstraintIndex constraint, uint32_t code);
  void note_special(ConstraintIndex constraint, bool special);
  void add_dissimilar(CellId cell, ConstraintIndex constraint, uint32_t code);
  Point3 direction(ConstraintIndex constraint) const;

  MapState& map_;
  const Tetrahedra& tetrahedra_;
  SegmentWalker walker_;
  ConstraintLists lists_;
  int limit_;
  uint32_t stamp_ = 0;
  CellId last_start_;     // a cell near the cameras, to start searches from
  bool spoiled_ = false;  // a run met a degeneracy: its constraint is traced again as a whole
  IdVector<ConstraintIndex, bool> special_;  // retired or degenerate
  IdVector<CellId, bool> marked_;            // scratch: is in crossed_
  std::vector<Run> to_run_;                  // scratch
  std::vector<ConstraintIndex> starts_;      // scratch: constraints whose first cell is gone
  std::vector<ConstraintIndex> whole_, grazing_;
  std::vector<CellId> crossed_;
  std::vector<ConstraintIndex> lost_ends_,
      tied_;  // constraints whose cell behind is gone, or is a convention
  IdVector<VertexIndex, CellId> cell_by_vertex_;  // any one of them
  std::vector<Point3> directions_;                // scratch
  std::vector<size_t> places_;                    // scratch
  int64_t runs_ = 0, traced_ = 0;
};

}  // namespace foresight::carving
