// What a Carver sends: net deltas and snapshots.
#include <algorithm>

#include "procs/carver/carver_impl.h"
#include "procs/carver/evidence.h"

namespace foresight {

using carving::CellState;
using carving::ConstraintIndex;
using carving::PointIndex;
using carving::VertexIndex;

CarvingVertex Carver::Impl::vertex_message(VertexIndex vertex) const {
  const carving::Point3& p = delaunay.tetrahedra().positions[vertex];
  return {vertices.id_of(vertex),
          Eigen::Vector3d(p[0], p[1], p[2]).cast<float>(),  // exact: all are floats
          vertices.records()[vertex].evidence};
}

CarvingCell Carver::Impl::cell_message(CellId cell) const {
  CarvingCell message;
  message.id = cell;
  for (size_t i = 0; i < 4; ++i) {
    message.vertices[i] = vertices.id_of(delaunay.tetrahedra().cells[cell].vertices[i]);
  }
  message.constraints = tracer.lists().constraints(cell);
  message.votes = tracer.lists().votes(cell);
  return message;
}

CarvingDelta Carver::Impl::net_delta(const carving::TriangulationChange& change) {
  CarvingDelta delta;
  delta.cells_removed = change.destroyed;
  delta.vertices_updated = refresh_evidence(vertices_of_changed_constraints());
  for (const PointId id : vertices.erased_ids()) {
    const PointIndex point = map.find_point(id);
    const VertexIndex vertex = point.is_valid() ? map.points[point].vertex : VertexIndex();
    const bool still_a_vertex = vertex.is_valid() && vertices.id_of(vertex) == VertexId(id);
    if (!still_a_vertex) delta.vertices_removed.emplace_back(id);
  }
  for (const VertexIndex vertex : vertices.inserted()) {
    if (!vertices.records()[vertex].owner.is_valid()) continue;
    delta.vertices_set.push_back(vertex_message(vertex));
  }
  for (const CellId cell : change.created) delta.cells_added.push_back(cell_message(cell));
  auto& lists = tracer.lists();
  for (const CellId cell : lists.take_changed()) {
    if (delaunay.tetrahedra().states[cell] != CellState::kKept) continue;
    delta.cells_updated.push_back({cell, lists.constraints(cell), lists.votes(cell)});
  }
  cells_replaced = change.destroyed.size();
  return delta;
}

// Only where constraints came or went, and at new vertices, can it have changed.
std::vector<VertexIndex> Carver::Impl::vertices_of_changed_constraints() const {
  std::vector<VertexIndex> affected = vertices.inserted();
  for (const carving::RetiredConstraint& constraint : map.staged.retired)
    affected.push_back(constraint.vertex);
  for (const ConstraintIndex constraint : map.staged.issued) {
    const carving::ConstraintRecord& record = map.constraints[constraint];
    if (record.state != carving::ConstraintState::kNew) continue;
    affected.push_back(map.points[record.point].vertex);
  }
  std::sort(affected.begin(), affected.end());
  affected.erase(std::unique(affected.begin(), affected.end()), affected.end());
  return affected;
}

// Returns what receivers have to be told of the vertices that they know.
std::vector<CarvingVertexUpdate> Carver::Impl::refresh_evidence(
    const std::vector<VertexIndex>& affected) {
  std::vector<CarvingVertexUpdate> updates;
  for (const VertexIndex vertex : affected) {
    const carving::VertexRecord& record = vertices.records()[vertex];
    if (!record.owner.is_valid()) continue;
    const VertexEvidence before = record.evidence, now = evidence_at(map, record);
    vertices.set_evidence(vertex, now);
    if (now != before && !record.fresh) updates.push_back({vertices.id_of(vertex), now});
  }
  return updates;
}

// After a rebuild: everything that was goes, everything that is comes. Both are snapshots.
CarvingDelta Carver::Impl::replacement(const CarvingDelta& before, CarvingDelta after) {
  std::vector<VertexId> ids;
  for (const CarvingVertex& vertex : after.vertices_set) ids.push_back(vertex.id);
  std::sort(ids.begin(), ids.end());
  for (const CarvingVertex& vertex : before.vertices_set) {
    if (std::binary_search(ids.begin(), ids.end(), vertex.id)) continue;
    after.vertices_removed.push_back(vertex.id);
  }
  for (const CarvingCell& cell : before.cells_added) after.cells_removed.push_back(cell.id);
  return after;
}

CarvingDelta Carver::Impl::snapshot() const {
  CarvingDelta delta;
  if (!delaunay.built()) return delta;
  const auto& records = vertices.records();
  for (const VertexIndex vertex : records.ids()) {
    if (vertex >= carving::kFirstPoint && !records[vertex].owner.is_valid()) continue;
    delta.vertices_set.push_back(vertex_message(vertex));
  }
  const auto& states = delaunay.tetrahedra().states;
  for (const CellId cell : states.ids()) {
    if (states[cell] != CellState::kKept) continue;
    delta.cells_added.push_back(cell_message(cell));
  }
  return delta;
}

}  // namespace foresight
