// CellComplex::find_broken_invariant: an independent, slow check of every invariant.
#include "procs/mesher/cell_complex.h"

namespace foresight {

std::optional<std::string_view> CellComplex::find_broken_invariant() const {
  std::vector<int32_t> degrees(points_.size(), 0);
  int32_t cells = 0, hull_facets = 0;
  for (int32_t slot = 0; slot < 4 * cell_limit(); ++slot) {
    if (!exists(slot / 4)) continue;
    if (slot % 4 == 0) ++cells;
    if (vertex(slot) < 0 || vertex(slot) >= vertex_limit()) return "vertex out of range";
    if (!exists_vertex(vertex(slot))) return "cell on a vertex that does not exist";
    ++degrees[index(vertex(slot))];
    const int32_t other = twin(slot);
    if (other < 0) {
      ++hull_facets;
      continue;
    }
    if (other >= 4 * cell_limit() || !exists(other / 4)) return "neighbour does not exist";
    if (twin(other) != slot) return "neighbours are not mutual";
    if (facet_key(slot) == facet_key(other)) return "neighbours overlap";
    if (facet_key(slot) != facet_key(other).reversed()) return "twins differ in vertices";
    if (area(slot) != area(other)) return "twins differ in area";
  }
  if (cells != cell_count_) return "cell count";
  if (hull_facets != hull_facet_count()) return "facet count";
  for (int32_t i = 0; i < vertex_limit(); ++i) {
    if (degrees[index(i)] != vertex_degree(i)) return "vertex degree";
    if (exists_vertex(i) != (vertex_indices_.find(vertex_id(i)) == i)) {
      return "vertex index";
    }
  }
  return std::nullopt;
}

}  // namespace foresight
