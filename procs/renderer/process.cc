#include "procs/renderer/process.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "common/image_codec.h"
#include "common/messages.h"

namespace foresight {
namespace {

constexpr Duration kStaleAfter = seconds(1);

Layout layout_of(const std::string& name) {
  if (name == "predicted") return Layout::kPredicted;
  return name == "delayed" ? Layout::kDelayed : Layout::kSideBySide;
}

std::string milliseconds_text(Duration d) {
  return std::to_string(std::llround(1e3 * d.seconds())) + " ms";
}

std::string percent_text(double share) { return std::to_string(std::lround(100 * share)) + "%"; }

}  // namespace

struct RendererProcess::Gl {
  Gl(std::unique_ptr<GlContext> context_in, const SceneOptions& options)
      : context(std::move(context_in)), scene(options) {}
  std::unique_ptr<GlContext> context;  // destroyed last
  SceneRenderer scene;
  VideoRenderer video;
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
  const Domain here = Domain::kOperator;
  node.subscribe<camera_info_t>({.channel = "CAMERA_INFO", .domain = here, .doc = "intrinsics"},
                                Queue::kLatest,
                                [this](const camera_info_t& m) { on_camera_info(m); });
  node.subscribe<view_t>(
      {.channel = "VIEW", .domain = here, .rate_hz = 30, .doc = "delayed video with its poses"},
      Queue::kLatest, [this](const view_t& m) { on_view(m); });
  node.subscribe<mesh_t>({.channel = "MESH", .domain = here, .doc = "the delayed model"},
                         Queue::kLatest, [this](const mesh_t& m) { on_mesh(m); });
  node.subscribe<camera_pose_t>({.channel = "CAMERA_POSE",
                                 .domain = Domain::kRobot,
                                 .rate_hz = 30,
                                 .doc = "undelayed; stands in for the operator's command"},
                                Queue::kLatest, [this](const camera_pose_t& m) { on_pose(m); });
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

int RendererProcess::triangles() const { return gl_->scene.triangles(); }

void RendererProcess::start() {
  const bool has_display =
      std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr;
  const bool window = params_.display == "window" || (params_.display == "auto" && has_display);
  const int height_px = params_.picture_width_px * 3 / 4;
  const int width_px = params_.picture_width_px * (layout_ == Layout::kSideBySide ? 2 : 1);
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
  video_time_ = {message.utime};
  video_changed_ = true;
  ++videos_;
  const auto pose = read_pose(message.pose);
  if (!pose) return;
  follow_epoch(message.pose.epoch);
  const TexturingView view{message.utime, video_time_, *camera_, *pose, std::move(*image)};
  if (gl_->scene.add_view(view) != InputStatus::kAccepted) {
    return node_.reject_message("VIEW", "cannot be used as a texture");
  }
  texture_time_ = video_time_;
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

void RendererProcess::on_pose(const camera_pose_t& message) {
  pose_ = read_pose(message);
  pose_time_ = {message.utime};
  pose_epoch_ = message.epoch;
  lost_reason_ = message.reason;
  draw();
}

void RendererProcess::draw() {
  const Time begin = node_.now();
  last_draw_ = begin;
  gl_->context->make_current();
  const bool has_prediction = draw_predicted();
  compose(has_prediction);
  gl_->context->present();
  ++drawn_;
  handle_keys();
  if (has_prediction) read_prediction();
  publish_stats(has_prediction, node_.now() - begin);
}

bool RendererProcess::draw_predicted() {
  const bool one_map = epoch_ != 0 && mesh_epoch_ == epoch_ && pose_epoch_ == epoch_;
  if (!camera_ || !pose_ || !one_map || gl_->scene.triangles() == 0) return false;
  const RenderOptions options{.used_views = params_.used_views,
                              .paint_hull = params_.paint_guesses,
                              .paint_background = params_.paint_guesses};
  return gl_->scene.render(camera_->undistorted(), *pose_, options).status == RenderStatus::kDrawn;
}

// Without a prediction its place shows the delayed video, and the panel says so.
void RendererProcess::compose(bool has_prediction) {
  GlContext& context = *gl_->context;
  if (camera_ && std::exchange(video_changed_, false)) gl_->video.draw(camera_->undistorted());
  context.bind();
  gl_->hud.clear();
  const double aspect =
      camera_ ? static_cast<double>(camera_->width_px) / camera_->height_px : 4.0 / 3.0;
  const Places places = place_pictures(layout_, context.width_px(), context.height_px(), aspect);
  if (places.delayed) {
    if (camera_) gl_->hud.draw_texture(gl_->video.colour(), *places.delayed, context.height_px());
    gl_->hud.draw_panel(delayed_panel(), *places.delayed, context.height_px());
  }
  if (places.predicted) {
    if (camera_) {
      gl_->hud.draw_texture(has_prediction ? gl_->scene.colour() : gl_->video.colour(),
                            *places.predicted, context.height_px());
    }
    gl_->hud.draw_panel(predicted_panel(has_prediction), *places.predicted, context.height_px());
  }
}

Panel RendererProcess::delayed_panel() const {
  if (video_time_.us == 0) return {Badge::kNoModel, "DELAYED VIDEO", {"no video yet"}};
  const Duration age = node_.now() - video_time_;
  return {age > kStaleAfter ? Badge::kStale : Badge::kOk,
          "DELAYED VIDEO",
          {"delay " + milliseconds_text(age), std::to_string(std::lround(video_fps_)) + " fps"}};
}

Panel RendererProcess::predicted_panel(bool has_prediction) const {
  if (!has_prediction) {
    const bool lost = epoch_ != 0 && !pose_;
    return {lost ? Badge::kLost : Badge::kNoModel,
            "DELAYED VIDEO (no prediction)",
            {lost_reason_.empty() ? "waiting for the model" : lost_reason_}};
  }
  const Duration age = pose_time_ - texture_time_;
  return {age > kStaleAfter ? Badge::kStale : Badge::kOk,
          "PREDICTED VIEW",
          {"textures " + milliseconds_text(age) + " old",
           std::to_string(std::lround(draw_fps_)) + " fps",
           std::to_string(gl_->scene.triangles()) + " triangles",
           percent_text(shares_.newest + shares_.earlier) + " measured, " +
               percent_text(shares_.guess) + " guessed"}};
}

// Reading pixels back costs time: always for a listener, else twice a second for the figures.
void RendererProcess::read_prediction() {
  const bool due = node_.now() - shares_time_ >= milliseconds(500);
  if (!listener_ && !due) return;
  RenderedFrame picture = gl_->scene.read_back();
  shares_ = count_sources(picture.source);
  shares_time_ = node_.now();
  if (listener_) {
    listener_(
        {pose_time_, texture_time_, epoch_, *pose_, camera_->undistorted(), std::move(picture)});
  }
}

void RendererProcess::publish_stats(bool has_prediction, Duration elapsed) {
  display_stats_t stats{};
  stats.utime = pose_time_.us;
  stats.texture_utime = texture_time_.us;
  stats.mesh_utime = mesh_time_.us;
  stats.epoch = has_prediction ? epoch_ : 0;
  stats.draw_ms = static_cast<float>(1e3 * elapsed.seconds());
  stats.textured_share =
      has_prediction ? static_cast<float>(shares_.newest + shares_.earlier) : 0.f;
  stats.guessed_share = has_prediction ? static_cast<float>(shares_.guess) : 0.f;
  stats.n_triangles = gl_->scene.triangles();
  stats_.publish(stats);
  node_.set_metric("draw_ms", stats.draw_ms);
  if (has_prediction) {
    node_.set_state(ProcessState::kOk, "");
  } else {
    node_.set_state(ProcessState::kWaiting,
                    video_time_.us == 0 ? "no video yet" : "no prediction yet: " + lost_reason_);
  }
}

void RendererProcess::handle_keys() {
  for (int key : gl_->context->take_keys()) {
    if (key == '1') layout_ = Layout::kDelayed;
    if (key == '2') layout_ = Layout::kPredicted;
    if (key == '3') layout_ = Layout::kSideBySide;
    if (key == 'Q') node_.finish("closed by key", true);
  }
  if (gl_->context->should_close()) node_.finish("window closed", true);
}

void RendererProcess::record() {
  if (drawn_ == 0 || !gl_->recorder) return;
  if (std::exchange(recorded_drawn_, drawn_) != drawn_) {
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
  draw_fps_ = drawn_ - drawn_mark_;
  video_fps_ = videos_ - videos_mark_;
  drawn_mark_ = drawn_;
  videos_mark_ = videos_;
  node_.set_metric("fps", draw_fps_);
  node_.set_metric("textured_share", shares_.newest + shares_.earlier);
}

}  // namespace foresight
