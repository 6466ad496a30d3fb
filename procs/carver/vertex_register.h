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
  PointIndex owner;                    // none = a hull corner or unused
  bool fresh = false;                  // inserted since the last `finish`
  VertexEvidence evidence;             // up to date between deltas
  std::vector<PointIndex> also_there;  // other points at the same position
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

  /// Since the last `finish`: vertices inserted (some may be gone again: no owner), and point ids
  /// of vertices erased that existed before.
  const std::vector<VertexIndex>& inserted() const { return inserted_; }
  const std::vector<PointId>& erased_ids() const { return erased_ids_; }
  /// What receivers call it.
  VertexId id_of(VertexIndex vertex) const;
  const IdVector<VertexIndex, VertexRecord>& records() const { return records_; }
  void set_evidence(VertexIndex vertex, const VertexEvidence& evidence) {
    at(vertex).evidence = evidence;
  }
  int64_t live() const { return live_; }

 private:
  VertexIndex allocate();
  void place(std::vector<PointIndex> members);
  void adopt(VertexIndex vertex, std::vector<PointIndex> members);
  void erase(VertexIndex vertex);
  PointId id_of(PointIndex point) const { return map_.points[point].id; }
  VertexRecord& at(VertexIndex vertex) { return records_[vertex]; }

  MapState& map_;
  Delaunay& delaunay_;
  IdVector<VertexIndex, VertexRecord> records_;
  std::vector<VertexIndex> free_, dropped_, inserted_;
  std::vector<PointId> erased_ids_;
  int64_t live_ = 0;
};

}  // namespace foresight::carving
