#include "procs/mesher/process.h"

#include <filesystem>

#include "common/messages.h"

namespace foresight {

MesherProcess::MesherProcess(Node& node, const MesherParams& params)
    : node_(node),
      params_(params),
      mesher_(params.options()),
      requester_(node, "CARVING_DELTA", Domain::kRobot),
      meshes_(node.advertise<mesh_t>(
          {.channel = "MESH", .rate_hz = params.rate_hz, .doc = "the regularised surface"})) {
  node.subscribe<carving_delta_t>({.channel = "CARVING_DELTA", .doc = "changes of the carving"},
                                  Queue::kAll,
                                  [this](const carving_delta_t& m) { on_carving_delta(m); });
  node.subscribe<snapshot_request_t>(
      {.channel = "SNAPSHOT_REQUEST", .doc = "asks for the mesh again"}, Queue::kAll,
      [this](const snapshot_request_t& m) { on_request(m); });
  node.every(seconds(1.0 / params.rate_hz), "update", [this] { update(); });
  node.at(node.now(), [this] { node_.set_state(ProcessState::kWaiting, "no carving yet"); });
}

void MesherProcess::on_carving_delta(const carving_delta_t& message) {
  const Received received = receiver_.receive(message);
  if (received == Received::kBad) node_.reject_message("CARVING_DELTA", "contradicts itself");
  if (received == Received::kGap || received == Received::kBad) return requester_.want();
  if (received != Received::kDelta && received != Received::kSnapshot) return;
  requester_.satisfied();
  if (received == Received::kSnapshot) mesher_.reset();
  if (mesher_.apply(receiver_.take()) != ApplyResult::kOk) {
    node_.reject_message("CARVING_DELTA", "does not fit the cells known so far");
    receiver_.desynchronise();
    return requester_.want();
  }
  data_time_ = {message.utime};
  changed_ = true;
}

void MesherProcess::update() {
  if (!changed_ || !receiver_.is_synchronised()) return;
  changed_ = false;
  const Time begin = node_.now();
  const Mesh mesh = mesher_.update();
  mesh_t message = to_message(mesh);
  message.utime = data_time_.us;
  message.epoch = receiver_.epoch();
  message.version = last_.version + 1;
  last_ = std::move(message);
  meshes_.publish(last_);
  if (export_mesh(mesh)) node_.set_state(ProcessState::kOk, "");
  publish_metrics(node_.now() - begin);
}

// A failed export is reported and does not stop the meshes.
bool MesherProcess::export_mesh(const Mesh& mesh) {
  if (params_.export_ply.empty()) return true;
  // Written beside and renamed: a reader never sees half a file.
  const std::string part = params_.export_ply + ".part";
  if (const auto error = write_ply(mesh, part)) {
    node_.set_state(ProcessState::kDegraded, "export_ply: " + *error);
    return false;
  }
  std::error_code error;
  std::filesystem::rename(part, params_.export_ply, error);
  if (error) {
    node_.set_state(ProcessState::kDegraded,
                    "export_ply: " + params_.export_ply + ": " + error.message());
  }
  return !error;
}

void MesherProcess::on_request(const snapshot_request_t& request) {
  if (request.channel == "MESH" && last_.version > 0) meshes_.publish(last_);
}

void MesherProcess::publish_metrics(Duration elapsed) {
  const CutStatistics s = mesher_.statistics();
  node_.set_metric("cells", s.cells);
  node_.set_metric("carved_cells", s.carved_cells);
  node_.set_metric("relabelled_cells", s.changed_cells);
  node_.set_metric("triangles", last_.n_triangles);
  node_.set_metric("split_vertices", s.split_vertices);
  node_.set_metric("update_ms", 1e3 * elapsed.seconds());
}

}  // namespace foresight
