// The parts of a Carver; shared by carver.cc (what happens), carver_emit.cc (what is sent) and
// validate.cc.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "procs/carver/carver.h"
#include "procs/carver/delaunay.h"
#include "procs/carver/hull.h"
#include "procs/carver/map_state.h"
#include "procs/carver/tracer.h"
#include "procs/carver/vertex_register.h"

namespace foresight {

struct Carver::Impl {
  explicit Impl(const CarverOptions& o)
      : options(o),
        map(o.max_coordinate_mu),
        vertices(map, delaunay),
        tracer(map, delaunay.tetrahedra(), o.max_constraints_per_cell) {}

  CarvingDelta apply(const MapDelta& delta);
  CarvingDelta snapshot() const;
  CarverStatistics collect_statistics() const;
  std::string validate() const;

  RebuildReason rebuild_reason() const;
  bool update_is_dearer() const;
  int64_t memory_bytes() const;
  void thin();
  int64_t constraints_to_forget() const;
  bool staged_fits_hull() const;
  CarvingDelta update();
  CarvingDelta rebuild(RebuildReason reason);
  CarvingDelta net_delta(const carving::TriangulationChange& change);
  std::vector<carving::VertexIndex> vertices_of_changed_constraints() const;
  std::vector<CarvingVertexUpdate> refresh_evidence(
      const std::vector<carving::VertexIndex>& affected);
  static CarvingDelta replacement(const CarvingDelta& before, CarvingDelta after);
  CarvingVertex vertex_message(carving::VertexIndex vertex) const;
  CarvingCell cell_message(CellId cell) const;
  std::optional<carving::Hull> choose_hull() const;
  void finish();

  CarverOptions options;
  carving::MapState map;
  carving::Delaunay delaunay;
  carving::VertexRegister vertices;
  carving::Tracer tracer;
  carving::Hull hull;
  int64_t rebuilds = 0;
  RebuildReason last_rebuild = RebuildReason::kNever;
  int64_t cells_replaced = 0;
  bool over_limit = false;
};

}  // namespace foresight
