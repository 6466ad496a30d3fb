#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>

#include "common/delta_stream.h"
#include "common/node.h"
#include "common/process_main.h"
#include "foresight/camera_info_t.hpp"
#include "foresight/camera_pose_t.hpp"
#include "foresight/display_stats_t.hpp"
#include "foresight/mesh_t.hpp"
#include "foresight/view_t.hpp"
#include "procs/renderer/gl_context.h"
#include "procs/renderer/hud.h"
#include "procs/renderer/params.h"
#include "procs/renderer/recorder.h"
#include "procs/renderer/scene_renderer.h"
#include "procs/renderer/video_renderer.h"

namespace foresight {

/// The predicted view as it was drawn for one pose, for tests and evaluation.
struct PredictedFrame {
  Time pose_time;     // the "now" that it predicts
  Time texture_time;  // of the newest image in it
  int64_t epoch = 0;  // of the map
  Pose<Map, Cam> map_from_cam;
  CameraModel camera;  // distortion-free
  RenderedFrame picture;
};

/// Shows the delayed video and the predicted view (paper §II-B). VIEW, MESH and CAMERA_INFO come
/// delayed on the operator's side. On recorded video nobody commands the camera: the newest
/// undelayed CAMERA_POSE stands in for the command and is read on the robot's side.
class RendererProcess : public Process {
 public:
  using Params = RendererParams;
  static constexpr ProcessInfo kInfo{
      "renderer", "Shows the delayed video and the predicted view of now.", Domain::kOperator};

  RendererProcess(Node& node, const RendererParams& params);
  ~RendererProcess() override;
  void start() override;

  /// Of the mesh that is shown.
  int triangles() const;
  /// Called for every predicted view that is drawn, with its pixels.
  void set_listener(std::function<void(const PredictedFrame&)> listener) {
    listener_ = std::move(listener);
  }

 private:
  struct Gl;  // everything that needs the GL context

  void on_camera_info(const camera_info_t& message);
  void on_view(const view_t& message);
  void on_mesh(const mesh_t& message);
  void on_pose(const camera_pose_t& message);
  void follow_epoch(int64_t epoch);
  void draw();
  bool draw_predicted();
  void compose(bool has_prediction);
  void read_prediction();
  Panel delayed_panel() const;
  Panel predicted_panel(bool has_prediction) const;
  void publish_stats(bool has_prediction, Duration elapsed);
  void handle_keys();
  void record();
  void update_rates();

  Node& node_;
  RendererParams params_;
  Publisher<display_stats_t> stats_;
  SnapshotRequester mesh_requester_;
  std::unique_ptr<Gl> gl_;
  std::function<void(const PredictedFrame&)> listener_;

  std::optional<CameraModel> camera_;   // of the images
  std::optional<Pose<Map, Cam>> pose_;  // predicted
  std::string lost_reason_;
  int64_t epoch_ = 0, mesh_epoch_ = 0, pose_epoch_ = 0;
  Time pose_time_, video_time_, texture_time_, mesh_time_, last_draw_;
  bool video_changed_ = false;
  Layout layout_;
  SourceShares shares_;
  Time shares_time_;
  int drawn_ = 0, videos_ = 0, recorded_drawn_ = 0;
  int drawn_mark_ = 0, videos_mark_ = 0;
  double draw_fps_ = 0, video_fps_ = 0;
};

}  // namespace foresight
