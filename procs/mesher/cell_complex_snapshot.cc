// A whole complex at once: neighbours are found by sorting instead of one look-up per facet, and
// the table of facets is left until a later delta needs it.
#include <algorithm>

#include "procs/mesher/cell_complex.h"

namespace foresight {
namespace {

/// A facet without its smallest vertex; `low` < `high`.
struct Facet {
  VertexIndex low, high;
  Slot slot;
  bool ascending = false;  // counter-clockwise from outside: smallest vertex, low, high
  bool same_as(const Facet& other) const { return low == other.low && high == other.high; }
};

Facet facet_of(const FacetKey& key, Slot slot) {
  const auto [low, high] = std::minmax(key.vertices[1], key.vertices[2]);
  return {low, high, slot, key.vertices[1] == low};
}

}  // namespace

// All or nothing; the complex has no cells.
ApplyResult CellComplex::add_all_cells(const std::vector<CarvingCell>& cells) {
  ApplyResult result = ApplyResult::kOk;
  for (const CarvingCell& cell : cells) {
    result = place_cell(cell);
    if (result != ApplyResult::kOk) break;
  }
  if (result == ApplyResult::kOk) result = pair_all_facets(cells);
  if (result != ApplyResult::kOk) remove_all_cells();
  return result;
}

// All of a cell but its neighbours.
ApplyResult CellComplex::place_cell(const CarvingCell& cell) {
  Corners corners{};
  double volume = 0;
  const ApplyResult result = check_cell(cell, &corners, &volume);
  if (result != ApplyResult::kOk) return result;
  for (const Slot slot : slots_of(cell.id)) {
    const VertexIndex corner = corners[corner_of(slot)];
    vertices_[slot] = corner;
    ++points_[corner].degree;
  }
  set_evidence(cell.id, {cell.constraints, cell.votes});
  volumes_[cell.id] = volume;
  ++cell_count_;
  return ApplyResult::kOk;
}

ApplyResult CellComplex::pair_all_facets(const std::vector<CarvingCell>& cells) {
  // The facets by their smallest vertex (counting sort), then each vertex's by the other two.
  std::vector<size_t> ends(points_.size() + 1, 0);
  const auto for_each_facet = [&](auto&& visit) {
    for (const CarvingCell& cell : cells) {
      for (const Slot slot : slots_of(cell.id)) visit(facet_key(slot), slot);
    }
  };
  for_each_facet([&](const FacetKey& key, Slot) { ++ends[key.vertices[0].index() + 1]; });
  for (size_t v = 1; v < ends.size(); ++v) ends[v] += ends[v - 1];
  std::vector<Facet> facets(4 * cells.size());
  for_each_facet([&](const FacetKey& key, Slot slot) {
    facets[ends[key.vertices[0].index()]++] = facet_of(key, slot);
  });
  size_t first = 0;
  for (size_t v = 0; v < points_.size(); ++v) {
    const auto begin = facets.begin() + first;
    const auto end = facets.begin() + ends[v];
    std::sort(begin, end, [](const Facet& a, const Facet& b) {
      return a.low != b.low ? a.low < b.low : a.high != b.high ? a.high < b.high : a.slot < b.slot;
    });
    for (auto facet = begin; facet != end;) {
      auto next = facet + 1;
      while (next != end && next->same_as(*facet)) ++next;
      if (next - facet > 2) return ApplyResult::kCrowdedFacet;
      const bool paired = next - facet == 2;
      if (paired && facet->ascending == facet[1].ascending) return ApplyResult::kOverlappingCells;
      pair_facet(facet->slot, paired ? facet[1].slot : Slot());
      facet = next;
    }
    first = ends[v];
  }
  facets_known_ = false;
  return ApplyResult::kOk;
}

void CellComplex::pair_facet(Slot slot, Slot twin) {
  ++facet_count_;
  twins_[slot] = twin;
  if (twin.is_valid()) twins_[twin] = slot;
}

void CellComplex::remove_all_cells() {
  for (const CellId cell : cells()) {
    if (!exists(cell)) continue;
    for (const Slot slot : slots_of(cell)) {
      --points_[vertex(slot)].degree;
      twins_[slot] = Slot();
    }
    clear_cell(cell);
  }
  facets_.clear();
  facet_count_ = 0;
  facets_known_ = true;
}

void CellComplex::know_facets() {
  if (facets_known_) return;
  facets_.reserve(facet_count_);
  for (const Slot slot : slots()) {
    if (exists(cell_of(slot)) && twin(slot) < slot) facets_.insert(facet_key(slot), slot);
  }
  facets_known_ = true;
}

}  // namespace foresight
