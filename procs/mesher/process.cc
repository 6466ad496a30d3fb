#include "procs/mesher/process.h"

#include <algorithm>
#include <filesystem>

#include "common/messages.h"

namespace foresight {

MesherProcess::MesherProcess(Node& node, const MesherParams& params)
    : node_(node),
      params_(params),
      mesher_(params.options()),
      carving_(node, {.channel = "CARVING_DELTA", .doc = "changes of the carving"},
               [this](const DeltaStep<CarvingDelta>& step) { return apply(step); }),
      meshes_(node.advertise<mesh_t>(
          {.channel = "MESH", .rate_hz = params.rate_hz, .doc = "the regularised surface"})),
      responder_(node, "MESH", "asks for the mesh again", [this] {
        if (last_.version > 0) meshes_.publish(last_);
      }) {
  node.every(seconds(1.0 / params.rate_hz), "update", [this] { update(); });
  node.at(node.now(), [this] { node_.set_state(ProcessState::kWaiting, "no carving yet"); });
}

std::string MesherProcess::apply(const DeltaStep<CarvingDelta>& step) {
  if (step.is_snapshot) mesher_.reset();
  const ApplyResult result = mesher_.apply(step.delta);
  if (result != ApplyResult::kOk) return std::string(to_string(result));
  data_time_ = step.time;
  epoch_ = step.epoch;
  changed_ = true;
  if (last_.version == 0 || step.is_snapshot) update_soon();
  return {};
}

// Who has had no mesh yet, or one of another state, need not wait for the beat.
void MesherProcess::update_soon() {
  if (is_soon_) return;
  is_soon_ = true;
  node_.at(std::max(node_.now(), updated_ + kSnapshotInterval), [this] {
    is_soon_ = false;
    update();
  });
}

void MesherProcess::update() {
  if (!changed_ || !carving_.is_synchronised()) return;
  changed_ = false;
  const Time begin = updated_ = node_.now();
  const Mesh mesh = mesher_.update();
  mesh_t message = to_message(mesh);
  message.utime = data_time_.us;
  message.epoch = epoch_;
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
