#include "tests/mesher/mesher_checks.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace foresight {
namespace {

std::multiset<VertexId> corner_ids(const CellComplex& complex, CellId cell) {
  std::multiset<VertexId> ids;
  for (const Slot slot : slots_of(cell)) ids.insert(complex.vertex_id(complex.vertex(slot)));
  return ids;
}

CellVotes sorted_votes(const CellComplex& complex, CellId cell) {
  CellVotes votes = complex.votes(cell);
  std::array<std::pair<VertexId, int32_t>, 4> by_id;
  for (const Slot slot : slots_of(cell)) {
    const auto k = static_cast<size_t>(corner_of(slot));
    by_id[k] = {complex.vertex_id(complex.vertex(slot)), votes.entered[k]};
  }
  std::sort(by_id.begin(), by_id.end());
  for (size_t k = 0; k < 4; ++k) votes.entered[k] = by_id[k].second;
  return votes;
}

}  // namespace

ComplexContent content(const CellComplex& complex) {
  ComplexContent all;
  for (const CellId cell : complex.cells()) {
    if (!complex.exists(cell)) continue;
    CellContent& c = all[corner_ids(complex, cell)];
    c.constraints = complex.constraints(cell);
    c.votes = sorted_votes(complex, cell);
    c.volume = complex.volume(cell);
    for (const Slot slot : slots_of(cell)) {
      const VertexIndex corner = complex.vertex(slot);
      c.evidence[complex.vertex_id(corner)] = complex.evidence(corner);
      const Slot twin = complex.twin(slot);
      c.neighbours.insert(twin.is_valid() ? corner_ids(complex, cell_of(twin))
                                          : std::multiset<VertexId>{});
    }
  }
  return all;
}

Labels labels(const Mesher& mesher) {
  Labels result;
  const CellComplex& complex = mesher.complex();
  for (const CellId cell : complex.cells()) {
    if (!complex.exists(cell)) continue;
    std::array<VertexId, 4> key{};
    for (const Slot slot : slots_of(cell)) {
      key[static_cast<size_t>(corner_of(slot))] = complex.vertex_id(complex.vertex(slot));
    }
    std::sort(key.begin(), key.end());
    result[key] = mesher.carved()[cell];
  }
  return result;
}

bool has_one_fan_per_vertex(const Mesh& mesh) {
  std::vector<std::map<int32_t, int32_t>> rings(mesh.vertices_in_map.size());
  for (const auto& t : mesh.triangles) {
    for (size_t j = 0; j < 3; ++j) {
      auto& ring = rings[static_cast<size_t>(t[j])];
      if (!ring.emplace(t[(j + 1) % 3], t[(j + 2) % 3]).second) return false;
    }
  }
  for (const auto& ring : rings) {
    if (ring.empty()) return false;
    size_t steps = 0;
    int32_t at = ring.begin()->first;
    do {
      const auto next = ring.find(at);
      if (next == ring.end() || ++steps > ring.size()) return false;
      at = next->second;
    } while (at != ring.begin()->first);
    if (steps != ring.size()) return false;
  }
  return true;
}

std::string find_problem(const Mesh& mesh) {
  if (mesh.vertex_ids.size() != mesh.vertices_in_map.size()) return "vertices without ids";
  if (mesh.confidences.size() != mesh.vertices_in_map.size()) return "vertices without confidence";
  const MeshDefects defects = find_defects(mesh);
  if (defects.bad_indices > 0) return "a triangle with a bad index";
  if (defects.boundary_edges > 0) return "the mesh has a border";
  if (defects.misoriented_edges > 0) return "the mesh is not consistently oriented";
  if (defects.non_manifold_edges > 0) return "an edge with more than two triangles";
  return has_one_fan_per_vertex(mesh) ? "" : "a vertex of several fans, or of no triangle";
}

}  // namespace foresight
