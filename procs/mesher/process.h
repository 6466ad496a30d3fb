#pragma once

#include "common/delta_input.h"
#include "common/node.h"
#include "common/process_main.h"
#include "foresight/carving_delta_t.hpp"
#include "foresight/mesh_t.hpp"
#include "procs/mesher/mesher.h"
#include "procs/mesher/params.h"

namespace foresight {

/// CARVING_DELTA in, MESH out (paper §II-A).
class MesherProcess : public Process {
 public:
  using Params = MesherParams;
  static constexpr ProcessInfo kInfo{
      "mesher", "Regularises the carving by a graph cut and extracts its surface.", Domain::kRobot};

  MesherProcess(Node& node, const MesherParams& params);

 private:
  std::string apply(const DeltaStep<CarvingDelta>& step);
  void update();
  void update_soon();
  bool export_mesh(const Mesh& mesh);
  void publish_metrics(Duration elapsed);

  Node& node_;
  MesherParams params_;
  Mesher mesher_;
  DeltaInput<carving_delta_t, CarvingDelta> carving_;
  Publisher<mesh_t> meshes_;
  SnapshotResponder responder_;
  mesh_t last_{};
  Time data_time_;
  int64_t epoch_ = 0;  // of the map that the cells belong to
  Time updated_;
  bool changed_ = false, is_soon_ = false;
};

}  // namespace foresight
