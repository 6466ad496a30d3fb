#include "procs/carver/process.h"

#include <cstdio>

namespace foresight {

CarverProcess::CarverProcess(Node& node, const CarverParams& params)
    : node_(node),
      params_(params),
      carver_(params.carver_options()),
      map_(node, {.channel = "MAP_DELTA", .doc = "changes of the SLAM map"},
           [this](const DeltaStep<MapDelta>& step) {
             apply(step);
             return std::string();  // what makes no sense in a map is ignored and counted
           }),
      sender_(node.advertise<carving_delta_t>(
                  {.channel = "CARVING_DELTA", .doc = "changed cells and their constraint counts"}),
              node.now()),
      responder_(node, "CARVING_DELTA", "asks for the whole carving",
                 [this] { sender_.send_snapshot(data_time_, carver_.snapshot()); }) {
  node.at(node.now(), [this] { node_.set_state(ProcessState::kWaiting, "no map yet"); });
}

void CarverProcess::apply(const DeltaStep<MapDelta>& step) {
  const Time begin = node_.now();
  data_time_ = step.time;
  if (step.is_snapshot) {
    // The state before does not matter to anybody: what follows is a new stream's first delta.
    carver_.reset();
    carver_.apply(step.delta);
    sender_.restart(node_.now());
    sender_.send_delta(data_time_, step.epoch, carver_.snapshot());
  } else {
    sender_.send_delta(data_time_, step.epoch, carver_.apply(step.delta));
  }
  publish(carver_.statistics(), node_.now() - begin);
}

void CarverProcess::publish(const CarverStatistics& s, Duration elapsed) {
  char limit[64];
  std::snprintf(limit, sizeof limit, "memory limit of %.6g MB", params_.memory_limit_mb);
  if (s.over_memory_limit) {
    node_.set_state(ProcessState::kDegraded,
                    std::string(limit) + ": needs more even with one constraint per point");
  } else if (s.thinned_constraints > 0) {
    node_.set_state(ProcessState::kDegraded, std::string(limit) + ": " +
                                                 std::to_string(s.thinned_constraints) +
                                                 " oldest constraints were forgotten");
  } else {
    node_.set_state(ProcessState::kOk, "");
  }
  node_.set_metric("points", static_cast<double>(s.points));
  node_.set_metric("keyframes", static_cast<double>(s.keyframes));
  node_.set_metric("constraints", static_cast<double>(s.constraints));
  node_.set_metric("thinned_constraints", static_cast<double>(s.thinned_constraints));
  node_.set_metric("cells", static_cast<double>(s.cells));
  node_.set_metric("carved_cells", static_cast<double>(s.carved_cells));
  node_.set_metric("ignored_inputs", static_cast<double>(s.ignored_inputs));
  node_.set_metric("rebuilds", static_cast<double>(s.rebuilds));
  node_.set_metric("memory_mb", static_cast<double>(s.memory_bytes) / 1e6);
  node_.set_metric("update_ms", 1e3 * elapsed.seconds());
}

}  // namespace foresight
