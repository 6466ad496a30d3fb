#include "procs/renderer/process.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "common/fnv.h"
#include "common/image_codec.h"
#include "common/messages.h"
#include "common/robot_messages.h"

namespace foresight {
namespace {

struct LayoutKey {
  int key;
  Layout layout;
};
constexpr LayoutKey kLayoutKeys[] = {{'1', Layout::kDelayed},
                                     {'2', Layout::kPredicted},
                                     {'3', Layout::kSideBySide},
                                     {'4', Layout::kInset},
                                     {'5', Layout::kUndelayed}};

ProcessState state_of(DisplayState state) {
  switch (state) {
    case DisplayState::kWaiting:
      return ProcessState::kWaiting;
    case DisplayState::kOk:
      return ProcessState::kOk;
    case DisplayState::kDegraded:
      return ProcessState::kDegraded;
  }
  return ProcessState::kFailed;
}

// Tells what was forged by accident from what was sent.
uint64_t digest_of(const Mesh& mesh) {
  Fnv1a hash;
  hash.add(mesh.vertices_in_map);
  hash.add(mesh.triangles);
  hash.add(mesh.vertex_ids);
  hash.add(mesh.confidences);
  return hash.value();
}

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
      since_judged_(!node.is_simulated()),
      judged_(node.now()),
      layout_(params.layout) {
  subscribe();
  poses_ = make_pose_source(node, params, [this] { request_draw(); });
  const Duration period = seconds(1.0 / params.idle_rate_hz);
  node.every(period, "redraw", [this, period] {
    if (is_due(frame_.begin, period)) draw();
  });
  node.every(milliseconds(100), "doubt the mesh", [this] {
    if (mesh_gate_.is_unconfirmed(node_.now(), view_gate_.epoch())) ask_for_mesh();
  });
  node.every(seconds(1), "rates", [this] {
    update_rates();
    report_health();
  });
  if (!params.record.empty()) {
    node.every(seconds(1.0 / params.record_fps), "record", [this] { record(); });
  }
}

RendererProcess::~RendererProcess() = default;

void RendererProcess::subscribe() {
  const Domain here = Domain::kOperator;
  camera_info_input_ = node_.subscribe<camera_info_t>(
      {.channel = "CAMERA_INFO", .domain = here, .doc = "intrinsics"}, Queue::kLatest,
      [this](const camera_info_t& m) { on_camera_info(m); });
  view_input_ = node_.subscribe<view_t>(
      {.channel = "VIEW", .domain = here, .rate_hz = 30, .doc = "delayed video with its poses"},
      Queue::kLatest, [this](const view_t& m) { on_view(m); });
  mesh_input_ =
      node_.subscribe<mesh_t>({.channel = "MESH", .domain = here, .doc = "the delayed model"},
                              Queue::kLatest, [this](const mesh_t& m) { on_mesh(m); });
  if (params_.undelayed_video || layout_ == Layout::kUndelayed) {
    undelayed_view_input_ =
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
  const bool window =
      params_.display == Display::kWindow || (params_.display == Display::kAuto && has_display);
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
  report_health();
}

// Also when the clock was set back.
bool RendererProcess::is_due(Time last, Duration period) const {
  return node_.now() - last >= period || node_.now() < last;
}

void RendererProcess::Stream::add(Time t) {
  time = t;
  changed = true;
  ++count;
}

void RendererProcess::on_camera_info(const camera_info_t& message) {
  const auto camera = from_message(message);
  if (!camera || !is_possible(*camera)) {
    return camera_info_input_.reject("makes no sense as intrinsics");
  }
  if (!camera_info_.offer(*camera)) {
    return camera_info_input_.reject("contradicts the last: counts when it comes again");
  }
  camera_ = camera_info_.value();
}

void RendererProcess::on_view(const view_t& message) {
  if (!camera_) return;
  const Time time{message.utime}, now = node_.now();
  const StampVerdict verdict = view_gate_.admit(now, time);
  if (!is_taken(verdict)) return view_input_.reject(to_string(verdict));
  auto image = decode_image(message.image, 3);
  if (!image || gl_->video.set_image(*camera_, *image) != InputStatus::kAccepted) {
    return view_input_.reject("image is damaged or not of the camera's size");
  }
  view_watch_.arrive(now);
  video_delay_.measure(now - time);
  video_.add(time);
  if (verdict == StampVerdict::kRestarted) gl_->scene.clear_views_after(time);
  paint_with(message, std::move(*image));
}

// A new epoch is a new map: poses and meshes of the old one mean nothing in it.
void RendererProcess::paint_with(const view_t& message, Image image) {
  const auto pose = read_pose(message.pose);
  if (!pose) return;
  const int64_t epoch_before = view_gate_.epoch();
  if (!view_gate_.may_paint({message.utime}, message.pose.epoch, *pose,
                            gl_->scene.scene_size_mu())) {
    return view_input_.reject("its pose or its map contradicts the last");
  }
  if (view_gate_.epoch() != epoch_before) {
    gl_->scene.clear_views();
    texture_time_ = {};
  }
  const TexturingView view{message.utime, {message.utime}, *camera_, *pose, std::move(image)};
  if (gl_->scene.add_view(view) != InputStatus::kAccepted) {
    return view_input_.reject("cannot be used as a texture");
  }
  texture_time_ = {message.utime};
}

// Decoded only while it is shown.
void RendererProcess::on_undelayed_view(const view_t& message) {
  if (!camera_ || layout_ != Layout::kUndelayed) return;
  const auto image = decode_image(message.image, 3);
  if (!image || gl_->undelayed.set_image(*camera_, *image) != InputStatus::kAccepted) {
    return undelayed_view_input_.reject("image is damaged or not of the camera's size");
  }
  undelayed_.add({message.utime});
  request_draw();
}

void RendererProcess::on_mesh(const mesh_t& message) {
  const auto mesh = from_message(message);
  if (!mesh) return mesh_input_.reject("indices or counts do not fit");
  const MeshName name{message.epoch, message.version, {message.utime}, digest_of(*mesh)};
  if (!mesh_gate_.admit(node_.now(), name, view_gate_.epoch())) {
    ask_for_mesh();
    return mesh_input_.reject("does not follow the last: asked for again");
  }
  if (gl_->scene.set_mesh(*mesh) != InputStatus::kAccepted) {
    ask_for_mesh();
    return mesh_input_.reject("indices or counts do not fit");
  }
  mesh_requester_.satisfied();
}

void RendererProcess::ask_for_mesh() {
  mesh_gate_.ask();
  mesh_requester_.want();
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
  frame_ = {.begin = node_.now()};
  const Stopwatch watch(!node_.is_simulated());
  gl_->context->make_current();
  const auto pose = poses_->predict(node_.now());
  frame_.has_pose = pose.has_value();
  if (pose && draw_predicted(*pose)) frame_.prediction = pose;
  compose(frame_);
  gl_->context->present();
  drawn_.add(frame_.begin);
  publish_stats(frame_, watch.elapsed());
  handle_keys();
  if (frame_.prediction) read_prediction(*frame_.prediction);
}

// False where there is nothing to draw that belongs to the pose's map.
bool RendererProcess::draw_predicted(const PredictedPose& pose) {
  const int64_t epoch = view_gate_.epoch();
  const bool one_map =
      epoch != 0 && mesh_gate_.shown() && mesh_gate_.shown()->epoch == epoch && pose.epoch == epoch;
  if (!camera_ || !one_map || gl_->scene.triangles() == 0) return false;
  const RenderOptions options{.used_views = params_.used_views,
                              .least_confidence = params_.least_confidence,
                              .paint_hull = params_.paint_guesses,
                              .paint_background = params_.paint_guesses};
  return gl_->scene.render(camera_->undistorted(), pose.map_from_cam, options).status ==
         RenderStatus::kDrawn;
}

void RendererProcess::show(const VideoRenderer& video, const Rectangle& place, const Panel& panel) {
  const int height_px = gl_->context->height_px();
  if (camera_) gl_->hud.draw_texture(video.colour(), place, height_px);
  gl_->hud.draw_panel(panel, place, height_px);
}

// Without a prediction its place shows the delayed video, and the panel says so.
void RendererProcess::compose(const Frame& frame) {
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
  if (places.predicted && frame.prediction) {
    gl_->hud.draw_texture(gl_->scene.colour(), *places.predicted, context.height_px());
    gl_->hud.draw_panel(predicted_panel(prediction_status(frame)), *places.predicted,
                        context.height_px());
  } else if (places.predicted) {
    show(gl_->video, *places.predicted, predicted_panel(prediction_status(frame)));
  }
  if (places.delayed) show(gl_->video, *places.delayed, delayed_panel(video_.status(now)));
  if (places.undelayed) {
    show(gl_->undelayed, *places.undelayed, undelayed_panel(undelayed_.status(now)));
  }
}

PredictionStatus RendererProcess::prediction_status(const Frame& frame) const {
  PredictionStatus status;
  status.is_drawn = frame.prediction.has_value();
  status.was_mapped = view_gate_.epoch() != 0 && !frame.has_pose;
  status.reason = poses_->reason();
  status.note = poses_->note();
  if (frame.prediction) status.texture_age = frame.prediction->instant - texture_time_;
  status.fps = drawn_.fps;
  status.triangles = gl_->scene.triangles();
  status.shares = shares_;
  return status;
}

// Reading pixels back costs time: always for a listener, else twice a second for the figures.
void RendererProcess::read_prediction(const PredictedPose& pose) {
  const bool due = is_due(shares_time_, milliseconds(500));
  if (!listener_ && !due) return;
  RenderedFrame picture = gl_->scene.read_back();
  shares_ = count_sources(picture.source);
  shares_time_ = node_.now();
  if (listener_) {
    listener_({pose, texture_time_, camera_->undistorted(), std::move(picture)});
  }
}

void RendererProcess::publish_stats(const Frame& frame, Duration drawing) {
  display_stats_t stats{};
  stats.predicted_world_from_cam_quat_wxyz[0] = 1;
  stats.shown_utime = (frame.begin + drawing).us;
  if (const auto& pose = frame.prediction) {
    stats.utime = pose->instant.us;
    stats.command_utime = pose->command_time.us;
    stats.epoch = view_gate_.epoch();
    write_transform(pose->world_from_cam, stats.predicted_world_from_cam_quat_wxyz,
                    stats.predicted_world_from_cam_position_m);
    const SourceShares shares = shares_.value_or(SourceShares{});
    stats.textured_share = static_cast<float>(shares.newest + shares.earlier);
    stats.guessed_share = static_cast<float>(shares.guess);
  }
  stats.texture_utime = texture_time_.us;
  stats.mesh_utime = mesh_gate_.shown() ? mesh_gate_.shown()->time.us : 0;
  stats.draw_ms = static_cast<float>(1e3 * drawing.seconds());
  stats.n_triangles = gl_->scene.triangles();
  stats_.publish(stats);
  node_.set_metric("draw_ms", stats.draw_ms);
}

void RendererProcess::handle_keys() {
  for (int key : gl_->context->take_keys()) {
    for (const LayoutKey& l : kLayoutKeys) {
      if (key == l.key) layout_ = l.layout;
    }
    if (key == 'Q') node_.finish("closed by key", kExitDone);
  }
  if (gl_->context->should_close()) node_.finish("window closed", kExitDone);
}

void RendererProcess::record() {
  if (drawn_.count == 0 || !gl_->recorder) return;
  if (std::exchange(recorded_drawn_, drawn_.count) != drawn_.count) {
    gl_->context->make_current();
    gl_->recorded = gl_->context->read_rgb();
  }
  const Recorder::Written written = gl_->recorder->write(gl_->recorded);
  if (written == Recorder::Written::kEnded) {
    recording_complaint_ = "recording stopped after " + std::to_string(gl_->recorder->frames()) +
                           " pictures: " + gl_->recorder->why_ended();
    gl_->recorder.reset();
    return report_health();
  }
  recording_complaint_ =
      written == Recorder::Written::kYes
          ? ""
          : "ffmpeg takes no pictures: " + std::to_string(gl_->recorder->dropped()) +
                " are missing in the recording";
  node_.set_metric("recorded_frames", static_cast<double>(gl_->recorder->frames()));
  node_.set_metric("dropped_frames", static_cast<double>(gl_->recorder->dropped()));
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

// The one place that sets the state.
void RendererProcess::report_health() {
  if (node_.state() == ProcessState::kDone) return;
  video_delay_.end_second();
  DisplayFacts facts;
  facts.now = node_.now();
  facts.pictures = drawn_.count;
  facts.redraw_after = seconds(1.0 / params_.idle_rate_hz);
  facts.stood_still = std::min(since_judged_.elapsed(), facts.now - judged_) - seconds(1);
  facts.has_video = video_.count > 0;
  facts.has_prediction = frame_.prediction.has_value();
  facts.prediction_reason = poses_->reason().empty() ? "no model yet" : poses_->reason();
  facts.streams.push_back({"VIEW", view_watch_, seconds(1)});
  facts.delay = video_delay_.current();
  facts.normal_delay = video_delay_.normal();
  facts.recording = recording_complaint_;
  poses_->report(&facts);
  const DisplayVerdict verdict = judge_.judge(facts);
  since_judged_ = Stopwatch(!node_.is_simulated());
  judged_ = facts.now;
  node_.set_state(state_of(verdict.state), verdict.reason);
}

}  // namespace foresight
