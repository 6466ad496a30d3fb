#pragma once

#include "common/delta_input.h"
#include "common/node.h"
#include "common/process_main.h"
#include "foresight/carving_delta_t.hpp"
#include "foresight/map_delta_t.hpp"
#include "procs/carver/carver.h"
#include "procs/carver/params.h"

namespace foresight {

/// MAP_DELTA in, CARVING_DELTA out (paper §II-A).
class CarverProcess : public Process {
 public:
  using Params = CarverParams;
  static constexpr ProcessInfo kInfo{
      "carver", "Carves free space out of a Delaunay tetrahedralisation of the map points.",
      Domain::kRobot};

  CarverProcess(Node& node, const CarverParams& params);

 private:
  void apply(const DeltaStep<MapDelta>& step);
  void publish(const CarverStatistics& s, Duration elapsed);

  Node& node_;
  CarverParams params_;
  Carver carver_;
  DeltaInput<map_delta_t, MapDelta> map_;
  DeltaSender<carving_delta_t> sender_;
  SnapshotResponder responder_;
  Time data_time_;
};

}  // namespace foresight
