#pragma once

#include "common/params.h"
#include "procs/carver/carver.h"

namespace foresight {

struct CarverParams {
  CarverOptions options;
  double memory_limit_mb = 1024;

  CarverOptions carver_options() const {
    CarverOptions o = options;
    o.memory_limit_bytes = static_cast<int64_t>(1e6 * memory_limit_mb);
    return o;
  }

  template <class V>
  void visit(V& v) {
    v("max_constraints_per_cell", options.max_constraints_per_cell,
      {.unit = "1",
       .min = 0,
       .max = 1e6,
       .doc = "keep only the K most dissimilar constraints of a cell (paper §II-A); 0: all, exact. "
              "K is for mesher.energy=volume: visibility needs all"});
    v("hull_extent_factor", options.hull_extent_factor,
      {.unit = "1", .min = 2, .max = 1e4, .doc = "size of the bounding cube over that of the map"});
    v("rebuild_cost_ratio", options.rebuild_cost_ratio,
      {.unit = "1",
       .min = 0,
       .max = 1e9,
       .doc = "rebuild when an update costs more than this multiple of a rebuild"});
    v("memory_limit_mb", memory_limit_mb,
      {.unit = "MB",
       .min = 0,
       .max = 1e6,
       .doc = "beyond it the oldest constraints are forgotten; 0: no limit"});
  }
};

}  // namespace foresight
