#include "tests/mesher/delaunay_carving.h"

#include <algorithm>
#include <utility>

namespace foresight {
namespace {

uint64_t mix(uint64_t h) {
  h = (h ^ h >> 30) * 0xBF58476D1CE4E5B9u;
  h = (h ^ h >> 27) * 0x94D049BB133111EBu;
  return h ^ h >> 31;
}

}  // namespace

void DelaunayCarving::add_hull_corners(float half_size) {
  for (int32_t i = 0; i < 8; ++i) {
    const Eigen::Vector3f corner(i & 1 ? 1.f : -1.f, i & 2 ? 1.f : -1.f, i & 4 ? 1.f : -1.f);
    set_point(VertexId::hull_corner(i), half_size * corner);
  }
}

void DelaunayCarving::set_point(VertexId id, const Eigen::Vector3f& position) {
  remove_point(id);
  const auto before = triangulation_.number_of_vertices();
  const auto vertex = triangulation_.insert(to_cgal(position));
  if (triangulation_.number_of_vertices() == before) return;
  vertex->info() = id;
  vertices_[id] = vertex;
  positions_[id] = position;
}

void DelaunayCarving::remove_point(VertexId id) {
  const auto found = vertices_.find(id);
  if (found == vertices_.end()) return;
  triangulation_.remove(found->second);
  vertices_.erase(found);
  positions_.erase(id);
}

void DelaunayCarving::carve_segment(const Eigen::Vector3f& from, const Eigen::Vector3f& to) {
  auto it = triangulation_.segment_traverser_cells_begin(to_cgal(from), to_cgal(to));
  const auto end = triangulation_.segment_traverser_cells_end();
  for (; it != end; ++it) {
    if (!triangulation_.is_infinite(it)) ++it->info().constraints;
  }
}

void DelaunayCarving::carve_at_random(double share, uint32_t seed) {
  for (const auto& cell : triangulation_.finite_cell_handles()) {
    Corners corners = describe(cell).corners;
    std::sort(corners.begin(), corners.end());
    uint64_t h = seed;
    for (const VertexId v : corners) h = mix(h * 31 + static_cast<uint32_t>(v.value()));
    const bool carved = static_cast<double>(h >> 11) * 0x1p-53 < share;
    cell->info().constraints = carved ? 1 + static_cast<int32_t>(h % 3) : 0;
  }
}

DelaunayCarving::Sent DelaunayCarving::describe(Triangulation::Cell_handle cell) const {
  Sent sent;
  for (int k = 0; k < 4; ++k) {
    const auto i = static_cast<size_t>(k);
    sent.corners[i] = cell->vertex(k)->info();
    sent.positions[i] = positions_.at(sent.corners[i]);
  }
  sent.constraints = cell->info().constraints;
  return sent;
}

bool DelaunayCarving::still_in_place(const Sent& cell) const {
  for (size_t k = 0; k < 4; ++k) {
    const auto position = positions_.find(cell.corners[k]);
    if (position == positions_.end() || position->second != cell.positions[k]) return false;
  }
  return true;
}

CarvingDelta DelaunayCarving::take_delta() {
  CarvingDelta delta;
  std::map<Corners, Sent> now;
  for (const auto& cell : triangulation_.finite_cell_handles()) {
    const Sent sent = describe(cell);
    Corners key = sent.corners;
    std::sort(key.begin(), key.end());
    now.emplace(key, sent);
  }
  for (auto it = sent_cells_.begin(); it != sent_cells_.end();) {
    if (now.contains(it->first) && still_in_place(it->second)) {
      ++it;
      continue;
    }
    delta.cells_removed.push_back(it->second.id);
    free_ids_.push_back(it->second.id);
    it = sent_cells_.erase(it);
  }
  for (auto& [key, cell] : now) {
    const auto old = sent_cells_.find(key);
    if (old == sent_cells_.end()) {
      cell.id = take_id();
      delta.cells_added.push_back({cell.id, cell.corners, cell.constraints});
    } else {
      cell.id = old->second.id;
      if (cell.constraints != old->second.constraints) {
        delta.cells_updated.push_back({cell.id, cell.constraints});
      }
    }
  }
  sent_cells_ = std::move(now);
  take_vertices(&delta);
  return delta;
}

CellId DelaunayCarving::take_id() {
  if (free_ids_.empty()) return std::exchange(next_id_, next_id_.next());
  const CellId id = free_ids_.back();
  free_ids_.pop_back();
  return id;
}

void DelaunayCarving::take_vertices(CarvingDelta* delta) {
  for (const auto& [id, position] : sent_positions_) {
    if (!positions_.contains(id)) delta->vertices_removed.push_back(id);
  }
  for (const auto& [id, position] : positions_) {
    const auto old = sent_positions_.find(id);
    if (old == sent_positions_.end() || old->second != position) {
      delta->vertices_set.push_back({id, position});
    }
  }
  sent_positions_ = positions_;
}

CarvingDelta DelaunayCarving::snapshot() const {
  CarvingDelta delta;
  for (const auto& [id, position] : positions_) delta.vertices_set.push_back({id, position});
  for (const auto& cell : triangulation_.finite_cell_handles()) {
    const Sent sent = describe(cell);
    delta.cells_added.push_back(
        {CellId::at(delta.cells_added.size()), sent.corners, sent.constraints});
  }
  return delta;
}

}  // namespace foresight
