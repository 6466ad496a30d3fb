#pragma once

#include "common/params.h"
#include "procs/carver/carver.h"

namespace foresight {

struct CarverParams {
  CarverOptions options;

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
  }
};

}  // namespace foresight
