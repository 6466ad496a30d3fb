// Which points sit at which vertex of the triangulation. Coincident points share a vertex, which
// bears the smallest of their ids, so that the result does not depend on the order of events.
#pragma once

#include <cstdint>
#include <vector>

#include "common/carving_delta.h"
#include "procs/carver/delaunay.h"
#include "procs/carver/map_state.h"

namespace foresight::carving {

struct VertexRecord {
  int32_t owner = -1;               // point; −1 = a hull corner or unused
  bool fresh = false;               // inserted since the last `finish`
  VertexEvidence evidence;          // up to date between deltas
  std::vector<int32_t> also_there;  // other points at the same position
};

class VertexRegister {
 public:
  VertexRegister(MapState& map, Delaunay& delaunay) : map_(map), delaunay_(delaunay) { clear(); }

  void clear();
  /// Takes detached points out of the triangulation and puts waiting ones in.
  void update(const StagedChanges& staged);
  /// Registers all living points anew and builds the triangulation from scratch.
  void rebuild(const std::array<Point3, 8>& corners);
  void finish();

  /// Since the last `finish`: vertices inserted (some may be gone again: owner −1), and point ids
  /// of vertices erased that existed before.
  const std::vector<int32_t>& inserted() const { return inserted_; }
  const std::vector<PointId>& erased_ids() const { return erased_ids_; }
  /// The id a receiver knows: the owner's, or −1…−8 for a hull corner.
  VertexId external_id(int32_t vertex) const;
  const std::vector<VertexRecord>& records() const { return records_; }
  void set_evidence(int32_t vertex, const VertexEvidence& evidence) {
    at(vertex).evidence = evidence;
  }
  int64_t live() const { return live_; }

 private:
  int32_t allocate();
  void place(std::vector<int32_t> members);
  void adopt(int32_t vertex, std::vector<int32_t> members);
  void erase(int32_t vertex);
  PointId id_of(int32_t point) const { return map_.points[static_cast<size_t>(point)].id; }
  VertexRecord& at(int32_t vertex) { return records_[static_cast<size_t>(vertex)]; }

  MapState& map_;
  Delaunay& delaunay_;
  std::vector<VertexRecord> records_;
  std::vector<int32_t> free_, dropped_, inserted_;
  std::vector<PointId> erased_ids_;
  int64_t live_ = 0;
};

}  // namespace foresight::carving
