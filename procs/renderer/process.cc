#include "procs/renderer/process.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <utility>

#include "common/image_codec.h"
#include "common/messages.h"
#include "common/robot_messages.h"

namespace foresight {
namespace {

struct NamedLayout {
  const char* name;
  int key;
  Layout layout;
};
constexpr NamedLayout kLayouts[] = {{"delayed", '1', Layout::kDelayed},
                                    {"predicted", '2', Layout::kPredicted},
                                    {"side_by_side", '3', Layout::kSideBySide},
                                    {"inset", '4', Layout::kInset},
                                    {"undelayed", '5', Layout::kUndelayed}};

Layout layout_of(const std::string& name) {
  for (const NamedLayout& l : kLayouts) {
    if (name == l.name) return l.layout;
  }
  return Layout::kSideBySide;
}

// What drawing takes, by the machine's own clock: a published clock stands still meanwhile.
class Stopwatch {
 public:
  explicit Stopwatch(bool runs) : runs_(runs), begin_(std::chrono::steady_clock::now()) {}
  Duration elapsed() const {
    if (!runs_) return {};
    return microseconds(std::chrono::duration_cast<std::chrono::microseconds>(
                            std::chrono::steady_clock::now() - begin_)
                            .count());
  }

 private:
  bool runs_;  // not on a simulated clock, where drawing takes no time
  std::chrono::steady_clock::time_point begin_;
};

}  // namespace

struct RendererProcess::Gl {
  Gl(std::unique_ptr<GlContext> context_in, const SceneOptions& options)
      : context(std::move(context_in)), scene(options) {}
  std::unique_ptr<GlContext> context;  // destroyed last
  SceneRenderer scene;
  VideoRenderer video, undelayed;
  Hud hud;
  std::unique_ptr<Recorder> recorder;
  Image recorded;  // the picture that was written last
};

RendererProcess::RendererProcess(Node& node, const RendererParams& params)
    : node_(node),
      params_(params),
      stats_(node.advertise<display_stats_t>({.channel = "DISPLAY_STATS",
                                              .domain = Domain::kOperator,
                                              .rate_hz = 30,
                                              .doc = "what was shown"})),
      mesh_requester_(node, "MESH", Domain::kOperator),
      layout_(layout_of(params.layout)) {
  subscribe();
  poses_ = make_pose_source(node, params, [this] { request_draw(); });
  const Duration period = seconds(1.0 / params.idle_rate_hz);
  node.every(period, "redraw", [this, period] {
    if (node_.now() - last_draw_ >= period) draw();
  });
  node.every(seconds(1), "rates", [this] { update_rates(); });
  if (!params.record.empty()) {
    node.every(seconds(1.0 / params.record_fps), "record", [this] { record(); });
  }
}

RendererProcess::~RendererProcess() = default;

void RendererProcess::subscribe() {
  const Domain here = Domain::kOperator;
  node_.subscribe<camera_info_t>({.channel = "CAMERA_INFO", .domain = here, .doc = "intrinsics"},
                                 Queue::kLatest,
                                 [this](const camera_info_t& m) { on_camera_info(m); });
  node_.subscribe<view_t>(
      {.channel = "VIEW", .domain = here, .rate_hz = 30, .doc = "delayed video with its poses"},
      Queue::kLatest, [this](const view_t& m) { on_view(m); });
  node_.subscribe<mesh_t>({.channel = "MESH", .domain = here, .doc = "the delayed model"},
                          Queue::kLatest, [this](const mesh_t& m) { on_mesh(m); });
  if (params_.undelayed_video || layout_ == Layout::kUndelayed) {
    node_.subscribe<view_t>({.channel = "VIEW",
                             .domain = Domain::kRobot,
                             .rate_hz = 30,
                             .doc = "undelayed video, for comparison"},
                            Queue::kLatest, [this](const view_t& m) { on_undelayed_view(m); });
  }
}

int RendererProcess::triangles() const { return gl_->scene.triangles(); }

void RendererProcess::start() {
  const bool has_display =
      std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr;
  const bool window = params_.display == "window" || (params_.display == "auto" && has_display);
  const int height_px = params_.picture_width_px * 3 / 4;
  const int width_px = params_.picture_width_px * (layout_ == Layout::kSideBySide ? 2 : 1);
  poses_->start();
  try {
    std::unique_ptr<GlContext> context;
    if (window) {
      context = std::make_unique<WindowContext>(
          WindowOptions{.width_px = width_px, .height_px = height_px});
    } else {
      context = std::make_unique<OffscreenContext>(width_px, height_px);
    }
    gl_ = std::make_unique<Gl>(std::move(context),
                               SceneOptions{.stored_views = params_.stored_views});
  } catch (const GlError& e) {
    throw UnavailableError(e.what());
  }
  if (!params_.record.empty()) {
    gl_->recorder =
        std::make_unique<Recorder>(params_.record, width_px, height_px, params_.record_fps);
  }
  node_.set_state(ProcessState::kWaiting, "no video yet");
}

void RendererProcess::Stream::add(Time t) {
  time = t;
  changed = true;
  ++count;
}

void RendererProcess::on_camera_info(const camera_info_t& message) {
  const auto camera = from_message(message);
  if (!camera) return node_.reject_message("CAMERA_INFO", "makes no sense as intrinsics");
  camera_ = camera;
}

// A new epoch is a new map: poses and meshes of the old one mean nothing in it.
void RendererProcess::follow_epoch(int64_t epoch) {
  if (epoch == epoch_) return;
  epoch_ = epoch;
  gl_->scene.clear_views();
  texture_time_ = {};
}

void RendererProcess::on_view(const view_t& message) {
  if (!camera_) return;
  auto image = decode_image(message.image, 3);
  if (!image || gl_->video.set_image(*camera_, *image) != InputStatus::kAccepted) {
    return node_.reject_message("VIEW", "image is damaged or not of the camera's size");
  }
  video_.add({message.utime});
  const auto pose = read_pose(message.pose);
  if (!pose) return;
  follow_epoch(message.pose.epoch);
  const TexturingView view{message.utime, {message.utime}, *camera_, *pose, std::move(*image)};
  if (gl_->scene.add_view(view) != InputStatus::kAccepted) {
    return node_.reject_message("VIEW", "cannot be used as a texture");
  }
  texture_time_ = {message.utime};
}

// Decoded only while it is shown.
void RendererProcess::on_undelayed_view(const view_t& message) {
  if (!camera_ || layout_ != Layout::kUndelayed) return;
  const auto image = decode_image(message.image, 3);
  if (!image || gl_->undelayed.set_image(*camera_, *image) != InputStatus::kAccepted) {
    return node_.reject_message("VIEW", "image is damaged or not of the camera's size");
  }
  undelayed_.add({message.utime});
  request_draw();
}

void RendererProcess::on_mesh(const mesh_t& message) {
  const auto mesh = from_message(message);
  if (!mesh || gl_->scene.set_mesh(*mesh) != InputStatus::kAccepted) {
    return node_.reject_message("MESH", "indices or counts do not fit");
  }
  mesh_requester_.satisfied();
  mesh_epoch_ = message.epoch;
  mesh_time_ = {message.utime};
}

// Drawing takes longer than handling a message: what has arrived meanwhile is handled first, and
// one picture shows it all.
void RendererProcess::request_draw() {
  if (std::exchange(draw_requested_, true)) return;
  node_.at(node_.now(), [this] {
    draw_requested_ = false;
    draw();
  });
}

void RendererProcess::draw() {
  const Time begin = node_.now();
  const Stopwatch watch(!node_.is_simulated());
  last_draw_ = begin;
  gl_->context->make_current();
  const bool has_prediction = draw_predicted();
  compose(has_prediction);
  gl_->context->present();
  drawn_.add(begin);
  publish_stats(has_prediction, begin, watch.elapsed());
  handle_keys();
  if (has_prediction) read_prediction();
}

bool RendererProcess::draw_predicted() {
  pose_ = poses_->predict(node_.now());
  const bool one_map = epoch_ != 0 && mesh_epoch_ == epoch_ && pose_ && pose_->epoch == epoch_;
  if (!camera_ || !one_map || gl_->scene.triangles() == 0) return false;
  const RenderOptions options{.used_views = params_.used_views,
                              .least_confidence = params_.least_confidence,
                              .paint_hull = params_.paint_guesses,
                              .paint_background = params_.paint_guesses};
  return gl_->scene.render(camera_->undistorted(), pose_->map_from_cam, options).status ==
         RenderStatus::kDrawn;
}

void RendererProcess::show(const VideoRenderer& video, const Rectangle& place, const Panel& panel) {
  const int height_px = gl_->context->height_px();
  if (camera_) gl_->hud.draw_texture(video.colour(), place, height_px);
  gl_->hud.draw_panel(panel, place, height_px);
}

// Without a prediction its place shows the delayed video, and the panel says so.
void RendererProcess::compose(bool has_prediction) {
  GlContext& context = *gl_->context;
  if (camera_ && std::exchange(video_.changed, false)) gl_->video.draw(camera_->undistorted());
  if (camera_ && std::exchange(undelayed_.changed, false)) {
    gl_->undelayed.draw(camera_->undistorted());
  }
  context.bind();
  gl_->hud.clear();
  const double aspect =
      camera_ ? static_cast<double>(camera_->width_px) / camera_->height_px : 4.0 / 3.0;
  const Places places = place_pictures(layout_, context.width_px(), context.height_px(), aspect);
  const Time now = node_.now();
  if (places.predicted && has_prediction) {
    gl_->hud.draw_texture(gl_->scene.colour(), *places.predicted, context.height_px());
    gl_->hud.draw_panel(predicted_panel(prediction_status(true)), *places.predicted,
                        context.height_px());
  } else if (places.predicted) {
    show(gl_->video, *places.predicted, predicted_panel(prediction_status(false)));
  }
  if (places.delayed) show(gl_->video, *places.delayed, delayed_panel(video_.status(now)));
  if (places.undelayed) {
    show(gl_->undelayed, *places.undelayed, undelayed_panel(undelayed_.status(now)));
  }
}

PredictionStatus RendererProcess::prediction_status(bool has_prediction) const {
  PredictionStatus status;
  status.is_drawn = has_prediction;
  status.was_mapped = epoch_ != 0 && !pose_;
  status.reason = poses_->reason();
  status.note = poses_->note();
  if (pose_) status.texture_age = pose_->instant - texture_time_;
  status.fps = drawn_.fps;
  status.triangles = gl_->scene.triangles();
  status.shares = shares_;
  return status;
}

// Reading pixels back costs time: always for a listener, else twice a second for the figures.
void RendererProcess::read_prediction() {
  const bool due = node_.now() - shares_time_ >= milliseconds(500);
  if (!listener_ && !due) return;
  RenderedFrame picture = gl_->scene.read_back();
  shares_ = count_sources(picture.source);
  shares_time_ = node_.now();
  if (listener_) {
    listener_({*pose_, texture_time_, camera_->undistorted(), std::move(picture)});
  }
}

void RendererProcess::publish_stats(bool has_prediction, Time begin, Duration drawing) {
  display_stats_t stats{};
  stats.predicted_world_from_cam_quat_wxyz[0] = 1;
  stats.shown_utime = (begin + drawing).us;
  if (has_prediction) {
    stats.utime = pose_->instant.us;
    stats.command_utime = pose_->command_time.us;
    stats.epoch = epoch_;
    write_transform(pose_->world_from_cam, stats.predicted_world_from_cam_quat_wxyz,
                    stats.predicted_world_from_cam_position_m);
    const SourceShares shares = shares_.value_or(SourceShares{});
    stats.textured_share = static_cast<float>(shares.newest + shares.earlier);
    stats.guessed_share = static_cast<float>(shares.guess);
  }
  stats.texture_utime = texture_time_.us;
  stats.mesh_utime = mesh_time_.us;
  stats.draw_ms = static_cast<float>(1e3 * drawing.seconds());
  stats.n_triangles = gl_->scene.triangles();
  stats_.publish(stats);
  node_.set_metric("draw_ms", stats.draw_ms);
  if (has_prediction) {
    node_.set_state(ProcessState::kOk, "");
  } else {
    node_.set_state(ProcessState::kWaiting,
                    video_.count == 0 ? "no video yet" : "no prediction yet: " + poses_->reason());
  }
}

void RendererProcess::handle_keys() {
  for (int key : gl_->context->take_keys()) {
    for (const NamedLayout& l : kLayouts) {
      if (key == l.key) layout_ = l.layout;
    }
    if (key == 'Q') node_.finish("closed by key", true);
  }
  if (gl_->context->should_close()) node_.finish("window closed", true);
}

void RendererProcess::record() {
  if (drawn_.count == 0 || !gl_->recorder) return;
  if (std::exchange(recorded_drawn_, drawn_.count) != drawn_.count) {
    gl_->context->make_current();
    gl_->recorded = gl_->context->read_rgb();
  }
  if (!gl_->recorder->write(gl_->recorded)) {
    gl_->recorder.reset();
    node_.set_state(ProcessState::kDegraded, "recording stopped: ffmpeg ended (disk full?)");
    return;
  }
  node_.set_metric("recorded_frames", static_cast<double>(gl_->recorder->frames()));
}

void RendererProcess::update_rates() {
  for (Stream* stream : {&drawn_, &video_, &undelayed_}) {
    stream->fps = stream->count - stream->mark;
    stream->mark = stream->count;
  }
  node_.set_metric("fps", drawn_.fps);
  const SourceShares shares = shares_.value_or(SourceShares{});
  node_.set_metric("textured_share", shares.newest + shares.earlier);
}

}  // namespace foresight
