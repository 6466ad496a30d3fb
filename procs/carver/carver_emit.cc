// What a Carver sends: net deltas and snapshots.
#include <algorithm>

#include "procs/carver/carver_impl.h"
#include "procs/carver/evidence.h"

namespace foresight {

using carving::CellState;

CarvingVertex Carver::Impl::vertex_message(int32_t vertex) const {
  const carving::Point3& p = delaunay.complex().positions[static_cast<size_t>(vertex)];
  return {vertices.external_id(vertex),
          Eigen::Vector3d(p[0], p[1], p[2]).cast<float>(),  // exact: all are floats
          vertices.records()[static_cast<size_t>(vertex)].evidence};
}

CarvingCell Carver::Impl::cell_message(int32_t cell) const {
  CarvingCell message;
  message.id = CellId(cell);
  for (size_t i = 0; i < 4; ++i) {
    message.vertices[i] =
        vertices.external_id(delaunay.complex().cells[static_cast<size_t>(cell)].vertices[i]);
  }
  message.constraints = static_cast<int32_t>(tracer.lists().constraints(cell));
  message.votes = tracer.lists().votes(cell);
  return message;
}

CarvingDelta Carver::Impl::net_delta(const carving::TriangulationChange& change) {
  CarvingDelta delta;
  for (const int32_t cell : change.destroyed) delta.cells_removed.emplace_back(cell);
  delta.vertices_updated = refresh_evidence(vertices_of_changed_rays());
  for (const PointId id : vertices.erased_ids()) {
    const int32_t point = map.find_point(id);
    const int32_t vertex = point < 0 ? -1 : map.points[static_cast<size_t>(point)].vertex;
    const bool still_a_vertex = vertex >= 0 && vertices.external_id(vertex) == VertexId(id);
    if (!still_a_vertex) delta.vertices_removed.emplace_back(id);
  }
  for (const int32_t vertex : vertices.inserted()) {
    if (vertices.records()[static_cast<size_t>(vertex)].owner < 0) continue;
    delta.vertices_set.push_back(vertex_message(vertex));
  }
  for (const int32_t cell : change.created) delta.cells_added.push_back(cell_message(cell));
  auto& lists = tracer.lists();
  for (const int32_t cell : lists.take_changed()) {
    if (delaunay.complex().states[static_cast<size_t>(cell)] != CellState::kKept) continue;
    delta.cells_updated.push_back(
        {CellId(cell), static_cast<int32_t>(lists.constraints(cell)), lists.votes(cell)});
  }
  cells_replaced = static_cast<int64_t>(change.destroyed.size());
  return delta;
}

// Only where rays came or went, and at new vertices, can it have changed.
std::vector<int32_t> Carver::Impl::vertices_of_changed_rays() const {
  std::vector<int32_t> affected = vertices.inserted();
  for (const carving::RetiredRay& ray : map.staged.retired) affected.push_back(ray.vertex);
  for (const int32_t ray : map.staged.issued) {
    const carving::RayRecord& record = map.rays[static_cast<size_t>(ray)];
    if (record.state != carving::RayState::kNew) continue;
    affected.push_back(map.points[static_cast<size_t>(record.point)].vertex);
  }
  std::sort(affected.begin(), affected.end());
  affected.erase(std::unique(affected.begin(), affected.end()), affected.end());
  return affected;
}

// Returns what receivers have to be told of the vertices that they know.
std::vector<CarvingVertexUpdate> Carver::Impl::refresh_evidence(
    const std::vector<int32_t>& affected) {
  std::vector<CarvingVertexUpdate> updates;
  for (const int32_t vertex : affected) {
    const carving::VertexRecord& record = vertices.records()[static_cast<size_t>(vertex)];
    if (record.owner < 0) continue;
    const VertexEvidence before = record.evidence, now = evidence_at(map, record);
    vertices.set_evidence(vertex, now);
    if (now != before && !record.fresh) updates.push_back({vertices.external_id(vertex), now});
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
  for (size_t vertex = 0; vertex < records.size(); ++vertex) {
    if (vertex >= carving::kHullCorners && records[vertex].owner < 0) continue;
    delta.vertices_set.push_back(vertex_message(static_cast<int32_t>(vertex)));
  }
  const auto& states = delaunay.complex().states;
  for (size_t cell = 0; cell < states.size(); ++cell) {
    if (states[cell] != CellState::kKept) continue;
    delta.cells_added.push_back(cell_message(static_cast<int32_t>(cell)));
  }
  return delta;
}

}  // namespace foresight
