// What is minimised, as capacities of the cells' graph (paper §II-A, Fig. 4): source = carved.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "procs/mesher/cell_complex.h"
#include "procs/mesher/max_flow.h"

namespace foresight {

/// The graph has a node for each cell, and an arc for each facet as the cell sees it.
inline MaxFlow::NodeId node_of(CellId cell) { return MaxFlow::NodeId(cell.value()); }

/// Weights of the visibility energy, in votes: what one constraint says weighs 1.
struct VisibilityWeights {
  /// Of a constraint that ends at a point, for surface behind that point.
  double surface = 0.7;
  /// Of a facet in the surface that is badly shaped, times 1 − min(cos φ, cos ψ) in 0…2: φ, ψ are
  /// the angles between the facet and the circumspheres of its two cells (Labatut et al. 2009).
  double shape = 0.8;
  /// Of a cell that no constraint crosses, for being free, if constraints cross two of its four
  /// neighbours (three or four: twice as much; one: a fifth): corners that they just miss. Not at
  /// the hull.
  double pocket = 0.4;
};
inline constexpr double kMaxVisibilityWeight = 1000;

/// The visibility energy on a graph that follows the complex. Each constraint says: the camera's
/// cell is free; each facet it crosses is no surface seen from its side; the cell behind its point
/// is not free. Weighed by numbers of constraints only: no length is involved, so the labels are
/// the same at every scale of the map.
class VisibilityGraph {
 public:
  explicit VisibilityGraph(const VisibilityWeights& weights) : weights_(weights) {}

  /// Brings the capacities up to date with the complex; the flow that fits through them stays.
  /// `flow` has to be the same object each time. O(touched cells).
  void update(CellComplex* complex, MaxFlow* flow);
  void reset();

 private:
  float cosine(Slot slot) const { return cosines_[cell_of(slot)][corner_of(slot)]; }
  void unlink_old(const CellComplex& complex, CellId cell, MaxFlow* flow) const;
  enum class Links { kAll, kOnce };  // of the cell, or of each pair of cells from the first one
  void weigh_cell(const CellComplex& complex, CellId cell, Links links, MaxFlow* flow) const;
  void weigh_neighbours(const CellComplex& complex, CellId cell, MaxFlow* flow) const;
  void weigh_terminal(const CellComplex& complex, CellId cell, MaxFlow* flow) const;

  VisibilityWeights weights_;
  IdVector<CellId, std::array<float, 4>> cosines_;  // and by facet
  bool started_ = false;
};

/// Eq. (1): n-links λ·area both ways, a t-link of the cell's volume to its carving's label (carved:
/// at least `min_constraints`), λ·area to the sink from cells on the hull. λ in map units.
/// O(cells).
void weigh_by_volume(const CellComplex& complex, double lambda_mu, int32_t min_constraints,
                     MaxFlow* flow);

}  // namespace foresight
