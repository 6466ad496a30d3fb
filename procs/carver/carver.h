// Incremental free-space carving (paper §II-A, Figs 2 and 3).
//
// The map points are the vertices of a 3D Delaunay triangulation. Every observation is a free-space
// constraint: the segment from the camera centre O to the point P must be empty, so it carves each
// finite cell whose interior it crosses (the one that holds the camera included).
//
//   Carver carver(CarverOptions{});
//   CarvingDelta delta = carver.apply(map_delta);   // send it
//   CarvingDelta all = carver.snapshot();           // for a receiver that joins late
//
// - "Interior crossed" is decided exactly, so the result depends on the map alone and not on the
//   order of events: incremental = from scratch = brute force, cell for cell (lossless mode).
// - Any map scale, lattices, planes, coincident points (they share a vertex, named by the smallest
//   id) and cameras on facets are fine. A point without observations is a vertex too.
// - Bad input (unknown or repeated ids, NaN, absurd coordinates) is ignored and counted.
// - Until two different positions are known nothing can be bounded and deltas are empty.
//
// Cost of `apply`: proportional to the cells and constraints in the changed region plus the cells
// crossed by new and lost constraints; see docs/algorithms/carving.md. Not thread-safe; pure: same
// calls, same output.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "common/carving_delta.h"
#include "common/map_delta.h"

namespace foresight {

struct CarverOptions {
  /// Constraints remembered per cell, the K most dissimilar (paper §II-A). 0 = all of them: exact.
  /// K > 0 saves memory; a cell may then lose its label when its surroundings change.
  int max_constraints_per_cell = 0;
  /// Half edge of the bounding cube around the map's origin, map units. 0 = automatic: centred on
  /// the map and `hull_extent_factor` times its half extent. A fixed cube that the map outgrows is
  /// replaced by an automatic one.
  double hull_half_size_mu = 0.0;
  /// Automatic cube: half edge over the half extent of points and cameras; ≥ 1.5.
  double hull_extent_factor = 64.0;
  /// Points and cameras must stay within this share of the automatic half edge; (0, 1).
  double hull_use_limit = 0.25;
  /// Coordinates beyond ± this are taken for broken input; map units.
  double max_coordinate_mu = 1e9;
  /// Rebuild from scratch when the estimated cost of the incremental update exceeds this multiple
  /// of the estimated cost of a rebuild. 0 = always rebuild; a huge value = never.
  double rebuild_cost_ratio = 1.0;
  /// When the carver holds more than this, the oldest constraints are forgotten, down to
  /// three quarters of it (a point keeps its newest constraint; thinning.h), and with them what
  /// they say of the point's depth (VertexEvidence). That happens at the end of each delta, which
  /// may need more meanwhile. 0 = no limit.
  int64_t memory_limit_bytes = 0;
};

/// Why the triangulation was last built from scratch.
enum class RebuildReason : uint8_t { kNever, kFirstBuild, kHullOutgrown, kManyChanges };

struct CarverStatistics {
  int64_t points = 0;    // known map points
  int64_t vertices = 0;  // vertices of the triangulation, without the 8 hull corners
  int64_t keyframes = 0;
  int64_t constraints = 0;          // known observations
  int64_t thinned_constraints = 0;  // forgotten because of the memory limit, since the start
  int64_t cells = 0;                // finite cells
  int64_t carved_cells = 0;
  int64_t constraint_cell_pairs = 0;  // sum of the cells' constraint counts
  int64_t max_constraints_in_cell = 0;
  int64_t memory_bytes = 0;        // estimate of what the carver holds
  bool over_memory_limit = false;  // and nothing is left that could be thinned
  int64_t ignored_inputs = 0;      // entries of deltas that were unknown, repeated or broken
  int64_t rebuilds = 0;
  RebuildReason last_rebuild = RebuildReason::kNever;
  double hull_half_size_mu = 0.0;  // now; 0 before the first build
  // The last `apply`:
  int64_t cells_replaced = 0;      // destroyed cells
  int64_t runs_retraced = 0;       // pieces of constraints re-traced inside the changed region
  int64_t constraints_traced = 0;  // constraints traced from camera to point
};

class Carver {
 public:
  explicit Carver(const CarverOptions& options = {});
  ~Carver();
  Carver(Carver&&) noexcept;
  Carver& operator=(Carver&&) noexcept;

  /// Takes a change of the map, returns the change of the carving (net: each cell at most once).
  CarvingDelta apply(const MapDelta& delta);
  /// The delta that builds the present carving on an empty receiver.
  CarvingDelta snapshot() const;
  /// Forgets everything (new epoch); the next delta applies to an empty receiver.
  void reset();

  CarverStatistics statistics() const;
  /// Empty when every invariant holds, else the first broken one: Delaunay property, adjacency,
  /// and each cell's constraints = an exact brute force over all constraints (for tests: slow).
  std::string validate() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace foresight
