#include "procs/carver/process.h"

#include <cstdio>

namespace foresight {

CarverProcess::CarverProcess(Node& node, const CarverParams& params)
    : node_(node),
      params_(params),
      carver_(params.carver_options()),
      requester_(node, "MAP_DELTA", Domain::kRobot),
      sender_(node.advertise<carving_delta_t>(
                  {.channel = "CARVING_DELTA", .doc = "changed cells and their constraint counts"}),
              node.now()) {
  node.subscribe<map_delta_t>({.channel = "MAP_DELTA", .doc = "changes of the SLAM map"},
                              Queue::kAll, [this](const map_delta_t& m) { on_map_delta(m); });
  node.subscribe<snapshot_request_t>(
      {.channel = "SNAPSHOT_REQUEST", .doc = "asks for the whole carving"}, Queue::kAll,
      [this](const snapshot_request_t& m) { on_request(m); });
  node.at(node.now(), [this] { node_.set_state(ProcessState::kWaiting, "no map yet"); });
}

void CarverProcess::on_map_delta(const map_delta_t& message) {
  const Time begin = node_.now();
  const Received received = receiver_.receive(message);
  if (received == Received::kBad) node_.reject_message("MAP_DELTA", "contradicts itself");
  if (received == Received::kGap || received == Received::kBad) return requester_.want();
  if (received != Received::kDelta && received != Received::kSnapshot) return;
  requester_.satisfied();
  const MapDelta delta = receiver_.take();
  data_time_ = {message.utime};
  if (received == Received::kDelta) {
    sender_.send_delta(data_time_, receiver_.epoch(), carver_.apply(delta));
  } else {
    // The state before does not matter to anybody: what follows is a new stream's first delta.
    carver_.reset();
    carver_.apply(delta);
    sender_.restart(node_.now());
    sender_.send_delta(data_time_, receiver_.epoch(), carver_.snapshot());
  }
  publish(carver_.statistics(), node_.now() - begin);
}

void CarverProcess::on_request(const snapshot_request_t& request) {
  if (request.channel == "CARVING_DELTA") sender_.send_snapshot(data_time_, carver_.snapshot());
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
