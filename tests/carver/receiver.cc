#include "tests/carver/receiver.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <set>

namespace foresight::carver_test {

std::string Receiver::apply(const CarvingDelta& delta) {
  std::set<VertexId> replaced;
  for (const CellId id : delta.cells_removed) {
    if (cells_.erase(id) == 0) return "removes the unknown cell " + std::to_string(id.value());
  }
  for (const VertexId id : delta.vertices_removed) {
    if (vertices_.erase(id) == 0) return "removes the unknown vertex " + std::to_string(id.value());
    evidence_.erase(id);
  }
  for (const CarvingVertex& vertex : delta.vertices_set) {
    if (!replaced.insert(vertex.id).second) return "sets a vertex twice";
    vertices_[vertex.id] = vertex.position_in_map;
    evidence_[vertex.id] = vertex.evidence;
  }
  for (const auto& [id, cell] : cells_) {
    for (const VertexId vertex : cell.vertices) {
      if (replaced.contains(vertex)) return "keeps a cell of a vertex that is set anew";
    }
  }
  for (const CarvingCell& cell : delta.cells_added) {
    if (!cells_.emplace(cell.id, cell).second) return "adds a cell that is there";
  }
  std::set<CellId> updated;
  for (const CarvingCellUpdate& update : delta.cells_updated) {
    const auto at = cells_.find(update.id);
    if (at == cells_.end()) return "updates an unknown cell";
    if (!updated.insert(update.id).second) return "updates a cell twice";
    if (at->second.constraints == update.constraints && at->second.votes == update.votes) {
      return "updates a cell to what it is";
    }
    at->second.constraints = update.constraints;
    at->second.votes = update.votes;
  }
  if (std::string breach = update_vertices(delta.vertices_updated); !breach.empty()) return breach;
  return check();
}

std::string Receiver::update_vertices(const std::vector<CarvingVertexUpdate>& updates) {
  std::set<VertexId> updated;
  for (const CarvingVertexUpdate& update : updates) {
    const auto at = evidence_.find(update.id);
    if (at == evidence_.end()) return "updates an unknown vertex";
    if (!updated.insert(update.id).second) return "updates a vertex twice";
    if (at->second == update.evidence) return "updates a vertex to what it is";
    at->second = update.evidence;
  }
  return "";
}

std::string Receiver::check() const {
  std::map<std::array<VertexId, 3>, int> facets;
  for (const auto& [id, cell] : cells_) {
    std::array<CGAL::Exact_predicates_inexact_constructions_kernel::Point_3, 4> corner;
    for (size_t i = 0; i < 4; ++i) {
      const auto at = vertices_.find(cell.vertices[i]);
      if (at == vertices_.end()) return "a cell has an unknown vertex";
      corner[i] = {at->second.x(), at->second.y(), at->second.z()};
      std::array<VertexId, 3> facet{};
      std::copy_if(cell.vertices.begin(), cell.vertices.end(), facet.begin(),
                   [&](VertexId vertex) { return vertex != cell.vertices[i]; });
      std::sort(facet.begin(), facet.end());
      ++facets[facet];
    }
    if (CGAL::orientation(corner[0], corner[1], corner[2], corner[3]) != CGAL::POSITIVE) {
      return "a cell is not positively oriented";
    }
  }
  int border = 0;
  for (const auto& [facet, count] : facets) {
    if (count > 2) return "a facet has more than two cells";
    if (count == 1 && facet[2].is_point()) return "a facet inside the hull has one cell";
    border += count == 1;
  }
  return cells_.empty() || border == 12 ? "" : "the cells do not tile the hull";
}

std::string to_text(const CellFacts& facts) {
  std::string text = std::to_string(facts.constraints) + " [";
  for (const int32_t n : facts.votes.entered) text += std::to_string(n) + " ";
  return text + "| " + std::to_string(facts.votes.started) + " | " +
         std::to_string(facts.votes.ended) + "]";
}

std::string differences(const Carving& actual, const Carving& expected) {
  std::map<std::array<VertexId, 4>, std::array<CellFacts, 2>> counts;
  for (const auto& [key, facts] : actual) counts[key][0] = facts;
  for (const auto& [key, facts] : expected) counts[key][1] = facts;
  std::string text;
  for (const auto& [key, pair] : counts) {
    if (pair[0] == pair[1]) continue;
    text += "(";
    for (const VertexId vertex : key) text += std::to_string(vertex.value()) + " ";
    text += ") " + to_text(pair[0]) + " not " + to_text(pair[1]) + "; ";
  }
  return text;
}

Carving Receiver::carving() const {
  Carving carving;
  for (const auto& [id, cell] : cells_) {
    std::array<VertexId, 4> key = cell.vertices;
    std::sort(key.begin(), key.end());
    CellFacts facts{cell.constraints, cell.votes};
    for (size_t i = 0; i < 4; ++i) {
      const auto k = std::find(cell.vertices.begin(), cell.vertices.end(), key[i]);
      facts.votes.entered[i] = cell.votes.entered[static_cast<size_t>(k - cell.vertices.begin())];
    }
    carving[key] = facts;
  }
  return carving;
}

}  // namespace foresight::carver_test
