#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>

#include "common/delta_stream.h"
#include "common/node.h"
#include "common/process_main.h"
#include "foresight/camera_info_t.hpp"
#include "foresight/display_stats_t.hpp"
#include "foresight/mesh_t.hpp"
#include "foresight/view_t.hpp"
#include "procs/renderer/display_judge.h"
#include "procs/renderer/gl_context.h"
#include "procs/renderer/hud.h"
#include "procs/renderer/model_gates.h"
#include "procs/renderer/panels.h"
#include "procs/renderer/params.h"
#include "procs/renderer/pose_source.h"
#include "procs/renderer/recorder.h"
#include "procs/renderer/scene_renderer.h"
#include "procs/renderer/video_renderer.h"

namespace foresight {

/// The predicted view as it was drawn for one pose, for tests and evaluation.
struct PredictedFrame {
  PredictedPose pose;
  Time texture_time;   // of the newest image in it
  CameraModel camera;  // distortion-free
  RenderedFrame picture;
};

/// What drawing takes, by the machine's own clock: a published clock stands still meanwhile.
class Stopwatch {
 public:
  /// `runs` is false on a simulated clock, where nothing takes time.
  explicit Stopwatch(bool runs) : runs_(runs) {}
  Duration elapsed() const {
    if (!runs_) return {};
    return microseconds(std::chrono::duration_cast<std::chrono::microseconds>(
                            std::chrono::steady_clock::now() - begin_)
                            .count());
  }

 private:
  bool runs_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

/// Shows the delayed video and the predicted view (paper §II-B). VIEW, MESH and CAMERA_INFO come
/// delayed on the operator's side; where the pose comes from: pose_source.h.
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

  // One picture on the display.
  struct Frame {
    Time begin;             // when drawing it began
    bool has_pose = false;  // it was known where the camera will be
    // The pose that the predicted view was drawn for; none: without a pose, or a model of its map.
    std::optional<PredictedPose> prediction;
  };

  void subscribe();
  void on_camera_info(const camera_info_t& message);
  void on_view(const view_t& message);
  void on_undelayed_view(const view_t& message);
  void on_mesh(const mesh_t& message);
  void paint_with(const view_t& message, Image image);
  void ask_for_mesh();
  void request_draw();
  void draw();
  bool draw_predicted(const PredictedPose& pose);
  void compose(const Frame& frame);
  void show(const VideoRenderer& video, const Rectangle& place, const Panel& panel);
  void read_prediction(const PredictedPose& pose);
  PredictionStatus prediction_status(const Frame& frame) const;
  void publish_stats(const Frame& frame, Duration drawing);
  void handle_keys();
  void record();
  void update_rates();
  void report_health();
  bool is_due(Time last, Duration period) const;

  // A stream of pictures: when the newest was taken, and how many come in a second.
  struct Stream {
    Time time;
    bool changed = false;
    int count = 0, mark = 0;
    double fps = 0;
    void add(Time t);
    VideoStatus status(Time now) const { return {time.us != 0, now - time, fps}; }
  };

  Node& node_;
  RendererParams params_;
  Input camera_info_input_, view_input_, undelayed_view_input_, mesh_input_;
  Publisher<display_stats_t> stats_;
  SnapshotRequester mesh_requester_;
  std::unique_ptr<PoseSource> poses_;
  std::unique_ptr<Gl> gl_;
  std::function<void(const PredictedFrame&)> listener_;

  PersistentValue<CameraModel> camera_info_{2};
  ViewGate view_gate_;
  MeshGate mesh_gate_;
  StreamWatch view_watch_;
  DelayWatch video_delay_;
  DisplayJudge judge_;
  Stopwatch since_judged_;
  Time judged_;

  std::optional<CameraModel> camera_;  // of the images
  Frame frame_;                        // the last
  Time texture_time_;
  Stream video_, undelayed_, drawn_;
  Layout layout_;
  std::optional<SourceShares> shares_;  // counted now and then
  Time shares_time_;
  int recorded_drawn_ = 0;
  std::string recording_complaint_;
  bool draw_requested_ = false;
};

}  // namespace foresight
