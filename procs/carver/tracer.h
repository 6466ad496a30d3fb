// Keeps the cells' lists equal to "the rays that cross the cell's interior" and "the rays that
// would go on into the cell beyond their point" while the triangulation and the rays change. The
// steps of one delta, in this order:
//
//   erase(retired)     old complex: find the cells that retired rays cross
//   …                  the triangulation changes
//   relocate()         cameras whose cell is gone
//   retrace(change)    rays of destroyed cells, inside the new cells only
//   prune()            take retired rays out of the surviving cells found by `erase`
//   trace(rays)        new rays
//   forget(retired)    rays that memory is too short for
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
  Tracer(MapState& map, const CellComplex& complex, int max_constraints_per_cell)
      : map_(map),
        complex_(complex),
        walker_(complex),
        limit_(static_cast<uint32_t>(std::max(0, max_constraints_per_cell))) {}

  void reset();
  void erase(std::span<const RetiredRay> retired);
  void relocate();
  void retrace(const TriangulationChange& change);
  void prune();
  void trace(const std::vector<int32_t>& rays);
  void forget(std::span<const RetiredRay> retired);
  /// After a rebuild, before trace(): all cells are new.
  void note_all_cells();

  ConstraintLists& lists() { return lists_; }
  const ConstraintLists& lists() const { return lists_; }
  int64_t runs() const { return runs_; }  // of the last delta
  int64_t traced() const { return traced_; }
  void start_delta(const std::vector<RetiredRay>& retired);

 private:
  RayRecord& ray_at(int32_t ray) { return map_.rays[static_cast<size_t>(ray)]; }
  CellState state_of(int32_t cell) const { return complex_.states[static_cast<size_t>(cell)]; }
  // A ray to be taken up again where it enters the changed region.
  struct Run {
    int32_t ray = 0;
    RegionEntry resume;
  };

  const Feature& aim(int32_t ray);
  void collect_runs(int32_t destroyed, const std::array<RegionEntry, 4>& entries);
  void collect_special(int32_t ray, uint32_t code);
  void run(const Run& run);
  void prefetch(size_t run) const;
  void retrace_start(int32_t ray);
  void queue_whole(int32_t ray);
  void queue_grazing();
  template <class Visit>
  void trace_whole(int32_t ray, Visit&& visit);
  void retrace_whole(const TriangulationChange& change);
  void note_cell(int32_t cell);
  void place_end(int32_t ray);
  void retrace_ends();
  void add(int32_t cell, int32_t ray, uint32_t code);
  void note_special(int32_t ray, bool special);
  void add_dissimilar(int32_t cell, int32_t ray, uint32_t code);
  Point3 direction(int32_t ray) const;

  MapState& map_;
  const CellComplex& complex_;
  SegmentWalker walker_;
  ConstraintLists lists_;
  uint32_t limit_;
  uint32_t stamp_ = 0;
  int32_t last_start_ = 0;       // a cell near the cameras, to start searches from
  bool spoiled_ = false;         // a run met a degeneracy: its ray is traced again as a whole
  std::vector<bool> special_;    // by ray: retired or degenerate
  std::vector<bool> marked_;     // scratch, by cell: is in crossed_
  std::vector<Run> to_run_;      // scratch
  std::vector<int32_t> starts_;  // scratch: rays whose first cell is gone
  std::vector<int32_t> whole_, crossed_, grazing_;
  std::vector<int32_t> lost_ends_, tied_;  // rays whose cell behind is gone, or is a convention
  std::vector<int32_t> cell_by_vertex_;    // any one of them
  std::vector<Point3> directions_;         // scratch
  std::vector<size_t> places_;             // scratch
  int64_t runs_ = 0, traced_ = 0;
};

}  // namespace foresight::carving
