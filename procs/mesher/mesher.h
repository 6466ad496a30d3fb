// From the raw carving to a regularised, closed mesh (paper §II-A, Fig. 4).
//
// The cells are labelled carved or not by the cheapest cut of their graph, and the mesh is the
// boundary. What is cheap: what contradicts few constraints (Energy::kVisibility, the default), or
// eq. (1),
//     E(u) = Σ volume of cells whose label differs from the carving
//          + λ · area between carved and uncarved cells.
// Outside the hull nothing is carved, hull facets of carved cells
// count as boundary. Among equal minima the one with the least carved space is taken, so the
// labels depend on nothing but the complex and the options.
//
//   Mesher mesher(MesherOptions{});
//   if (mesher.apply(delta) != ApplyResult::kOk) request_snapshot();
//   const Mesh mesh = mesher.update();
//
// apply() costs O(delta), update() O(cells) plus the cut. Pure: no clock, bus, threads or files.
#pragma once

#include <cstdint>
#include <vector>

#include "common/carving_delta.h"
#include "common/mesh.h"
#include "procs/mesher/cell_complex.h"
#include "procs/mesher/energies.h"
#include "procs/mesher/isosurface.h"
#include "procs/mesher/max_flow.h"

namespace foresight {

/// λ compares a volume with an area, so it is a length.
enum class LambdaUnit {
  kMapUnit,   // λ as the paper has it, in the map's arbitrary unit
  kRelative,  // λ in scene sizes (CutStatistics::scene_size): the same at every scale of the map
};

/// What is minimised.
enum class Energy {
  kVisibility,  // votes of the constraints, see VisibilityGraph
  kVolume,      // eq. (1)
};

struct MesherOptions {
  Energy energy = Energy::kVisibility;
  VisibilityWeights visibility = {};
  // Of eq. (1):
  /// Weight of the surface area, ≥ 0; 0 keeps the raw carving. Larger is smoother; cells with
  /// volume/area well below λ follow their neighbours.
  double lambda = 0.002;
  LambdaUnit lambda_unit = LambdaUnit::kRelative;
  /// A cell counts as carved in the data term with at least this many constraints, ≥ 1. More than
  /// one resists outliers, but keeps what only one constraint has carved.
  int32_t min_constraints = 1;
  ManifoldRepair repair = ManifoldRepair::kSplit;
  /// Passes of smoothing.h; 0: the mesh's vertices are the map's points.
  int32_t smoothing_passes = 0;
};

/// What the last update() did.
struct CutStatistics {
  int32_t cells = 0;
  int32_t hull_facets = 0;
  int32_t input_carved_cells = 0;  // crossed by min_constraints or more
  int32_t carved_cells = 0;        // after regularisation
  int32_t changed_cells = 0;
  int32_t decided_at_once = 0;    // cells whose label needed no search
  double scene_size_mu = 0;       // eq. (1): median distance of the map points from their median
  double lambda_mu = 0;           // eq. (1): λ in map units
  double changed_volume_mu3 = 0;  // first term of E
  double surface_area_mu2 = 0;    // the mesh's area: second term of E, without λ
  double energy_mu3 = 0;          // E of eq. (1)
  int32_t split_vertices = 0;     // see Isosurface
  int32_t split_edges = 0;
  int32_t smoothing_moves = 0;  // see smooth()
};

class Mesher {
 public:
  explicit Mesher(const MesherOptions& options);

  /// Rejects what does not fit and then changes nothing (see CellComplex).
  [[nodiscard]] ApplyResult apply(const CarvingDelta& delta) { return complex_.apply(delta); }
  void reset();

  /// Solves the cut on the present complex and extracts the mesh.
  Mesh update();

  CutStatistics statistics() const { return statistics_; }
  const CellComplex& complex() const { return complex_; }
  /// The labels behind the last mesh: 1 carved, 0 not, or no such cell.
  const IdVector<CellId, uint8_t>& carved() const { return carved_; }

 private:
  bool input_carved(CellId cell) const {
    return complex_.constraints(cell) >= options_.min_constraints;
  }
  double scene_size() const;
  void read_labels();
  void measure_energy();

  MesherOptions options_;
  CellComplex complex_;
  VisibilityGraph visibility_;
  MaxFlow flow_;
  IdVector<CellId, uint8_t> carved_;
  CutStatistics statistics_;
};

}  // namespace foresight
