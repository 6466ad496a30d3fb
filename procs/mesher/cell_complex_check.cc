// CellComplex::find_broken_invariant: an independent, slow check of every invariant.
#include "procs/mesher/cell_complex.h"

namespace foresight {

std::optional<std::string_view> CellComplex::find_broken_invariant() const {
  IdVector<VertexIndex, int32_t> degrees(points_.size(), 0);
  int32_t cells = 0, hull_facets = 0;
  for (const Slot slot : slots()) {
    if (!exists(cell_of(slot))) continue;
    if (corner_of(slot) == 0) ++cells;
    if (!points_.contains(vertex(slot))) return "vertex out of range";
    if (!exists_vertex(vertex(slot))) return "cell on a vertex that does not exist";
    ++degrees[vertex(slot)];
    const Slot other = twin(slot);
    if (!other.is_valid()) {
      ++hull_facets;
      continue;
    }
    if (!twins_.contains(other) || !exists(cell_of(other))) return "neighbour does not exist";
    if (twin(other) != slot) return "neighbours are not mutual";
    if (facet_key(slot) == facet_key(other)) return "neighbours overlap";
    if (facet_key(slot) != facet_key(other).reversed()) return "twins differ in vertices";
    if (area(slot) != area(other)) return "twins differ in area";
  }
  if (cells != cell_count_) return "cell count";
  if (hull_facets != hull_facet_count()) return "facet count";
  for (const VertexIndex i : vertices()) {
    if (degrees[i] != vertex_degree(i)) return "vertex degree";
    if (exists_vertex(i) != (vertex_table_.find(vertex_id(i)) == i)) {
      return "vertex index";
    }
  }
  return std::nullopt;
}

}  // namespace foresight
