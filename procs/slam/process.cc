#include "procs/slam/process.h"

#include <cstdio>
#include <exception>

#include "common/cpu_time.h"
#include "common/image_codec.h"
#include "common/messages.h"
#include "procs/slam/map_folder.h"

namespace foresight {
namespace {

constexpr Duration kRelocalisedShown = seconds(3);  // in the health, which comes once a second
constexpr Duration kDoubtShown = seconds(5);
constexpr double kLossShown = 0.1;     // share of the images of five seconds
constexpr int64_t kLossImages = 5;     // fewer are no trouble
constexpr int64_t kSourceChanges = 3;  // in five seconds: more than one source
constexpr Duration kHintAge = seconds(1);
constexpr double kFarthest_mu = 1e6;  // scenes are about 1 mu deep

void append(std::string* reasons, const std::string& reason) {
  if (!reason.empty()) *reasons += (reasons->empty() ? "" : "; ") + reason;
}

}  // namespace

SlamProcess::SlamProcess(Node& node, const SlamParams& params,
                         const std::optional<RunIdentity>& run)
    : node_(node),
      params_(params),
      poses_(node.advertise<camera_pose_t>(
          {.channel = "CAMERA_POSE", .rate_hz = 30, .doc = "pose of every frame, or why not"})),
      views_(node.advertise<view_t>(
          {.channel = "VIEW", .rate_hz = params.view_rate_hz, .doc = "frame with its pose"})),
      answers_(node.advertise<slam_answer_t>(
          {.channel = "SLAM_ANSWER", .doc = "what became of an order to slam"})),
      deltas_(node.advertise<map_delta_t>(
                  {.channel = "MAP_DELTA", .doc = "changed keyframes, points and observations"}),
              node.now()),
      shelf_(params.map_root),
      run_(run) {
  if (!params.map_folder.empty()) start_map_ = read_map_folder(params.map_folder);
  camera_info_input_ = node.subscribe<camera_info_t>(
      {.channel = "CAMERA_INFO", .rate_hz = 1, .doc = "intrinsics"}, Queue::kLatest,
      [this](const camera_info_t& m) { on_camera_info(m); });
  image_input_ = node.subscribe<image_t>({.channel = "IMAGE", .rate_hz = 30, .doc = "frames"},
                                         Queue::kLatest, [this](const image_t& m) { on_image(m); });
  command_input_ = node.subscribe<slam_command_t>(
      {.channel = "SLAM_COMMAND", .doc = "orders: save, load or reset the map"}, Queue::kAll,
      [this](const slam_command_t& m) { on_command(m); });
  hint_input_ = node.subscribe<pose_hint_t>(
      {.channel = "POSE_HINT", .doc = "where the arm says that the camera is", .optional = true},
      Queue::kLatest, [this](const pose_hint_t& m) { on_hint(m); });
  node.subscribe<snapshot_request_t>(
      {.channel = "SNAPSHOT_REQUEST", .doc = "asks for the whole map"}, Queue::kAll,
      [this](const snapshot_request_t& m) { on_request(m); });
  node.every(seconds(1), "input watch", [this] { watch_input(); });
}

void SlamProcess::watch_input() {
  if (node_.now() - last_arrival_ <= seconds(1) || reading_kept_) return;
  const bool rejecting = node_.now() - last_rejection_ <= seconds(1);
  node_.set_state(ProcessState::kWaiting, !camera_.camera() ? "no CAMERA_INFO yet"
                                          : rejecting ? "every IMAGE is rejected: it " + rejection_
                                                      : "no IMAGE arrives");
}

void SlamProcess::on_camera_info(const camera_info_t& message) {
  const auto stated = from_message(message);
  if (!stated) return camera_info_input_.reject("makes no sense as intrinsics");
  switch (camera_.offer(node_.now(), *stated)) {
    case CameraVerdict::kSame:
      return;
    case CameraVerdict::kDoubted:
      last_doubt_ = node_.now();
      return camera_info_input_.reject("contradicts the one before");
    case CameraVerdict::kNew:
      begin_with_camera();
      begin_in_start_map();
  }
}

void SlamProcess::begin_with_camera() {
  slam_ = std::make_unique<Slam>(*camera_.camera(), params_.options);
  core_epoch_ = -1;
  ++generation_;
  give_up_load("the camera has changed");
}

void SlamProcess::begin_in_start_map() {
  if (!start_map_) return;
  if (take_over(*start_map_)) return start_map_.reset();
  file_trouble_ = params_.map_folder + ": a map of another camera";
  camera_info_input_.reject("is not that of " + params_.map_folder);
}

void SlamProcess::on_image(const image_t& message) {
  const Time now = node_.now();
  images_.count(now, {message.utime}, message.frame_number, images_passed_over());
  camera_.saw_image(message.width_px, message.height_px);
  if (reading_kept_ || wait_for_kept(message)) return;
  if (!slam_) return;  // CAMERA_INFO comes first; "input watch" says so when it does not
  if (message.width_px != camera_.camera()->width_px ||
      message.height_px != camera_.camera()->height_px) {
    return reject("has not the size that CAMERA_INFO gives");
  }
  const auto image = decode_image(message, 1);
  if (!image || image->width_px != message.width_px || image->height_px != message.height_px) {
    return reject("is damaged");
  }
  switch (images_.judge(now, {message.utime})) {
    case ImageVerdict::kNotNewer:
      return reject("time-stamp does not increase");
    case ImageVerdict::kJumps:
      return reject("time-stamp jumps ahead");
    case ImageVerdict::kAbsurd:
      return reject("time-stamp is no time");
    case ImageVerdict::kNext:
      return track(message, *image);
  }
}

void SlamProcess::track(const image_t& message, const Image& image) {
  last_image_ = {message.utime};
  last_arrival_ = node_.now();
  const double begin_ms = thread_cpu_ms();
  const TrackingResult result = slam_->track(
      last_image_, {image.bytes.data(), image.width_px, image.height_px, image.width_px});
  track_ms_ = thread_cpu_ms() - begin_ms;
  update_epoch(last_image_);
  const camera_pose_t pose = to_message(result);
  poses_.publish(pose);
  publish_view(message, pose, result.is_keyframe);
  give_up_tiny_kept(result);
  publish_delta();
  continue_mapping();
  publish_health(result);
}

// Of IMAGE, because this process was too slow for them.
int64_t SlamProcess::images_passed_over() const {
  for (const PortRecord& port : node_.ports()) {
    if (port.is_input && port.spec.channel == "IMAGE") return port.skipped;
  }
  return 0;
}

void SlamProcess::reject(const char* why) {
  rejection_ = why;
  last_rejection_ = node_.now();
  image_input_.reject(why);
}

void SlamProcess::on_hint(const pose_hint_t& hint) {
  const auto pose = read_pose(hint);
  if (!pose || pose->translation().norm() > kFarthest_mu) {
    return hint_input_.reject("its pose is none");
  }
  if (!slam_ || hint.epoch != epoch_) return;  // of another map
  if (hint.utime < (last_image_ - kHintAge).us || hint.utime > (last_image_ + kHintAge).us) {
    return hint_input_.reject("is of another time than the images");
  }
  slam_->hint({hint.utime}, *pose);
}

void SlamProcess::on_request(const snapshot_request_t& request) {
  if (request.channel != "MAP_DELTA") return;
  const auto due = snapshots_.request(node_.now());
  if (!due) return;
  if (*due <= node_.now()) return send_snapshot();
  node_.at(*due, [this] { send_snapshot(); });
}

void SlamProcess::send_snapshot() {
  snapshots_.answered(node_.now());
  if (slam_ && epoch_is_sent_) deltas_.send_snapshot(data_time_, slam_->snapshot());
}

camera_pose_t SlamProcess::to_message(const TrackingResult& result) const {
  camera_pose_t pose{};
  pose.utime = result.time.us;
  pose.epoch = epoch_;
  pose.map_from_cam_quat_wxyz[0] = 1;
  pose.state = camera_pose_t::STATE_INITIALISING;
  if (result.state == TrackingState::kTracking) {
    pose.state = camera_pose_t::STATE_TRACKING;
    write_pose(result.map_from_cam, &pose);
  } else if (result.state == TrackingState::kLost) {
    pose.state = camera_pose_t::STATE_LOST;
  }
  pose.quality = static_cast<float>(result.quality);
  pose.points_predicted = result.points_predicted;
  pose.points_found = result.points_found;
  pose.reason = result.reason;
  return pose;
}

void SlamProcess::publish_view(const image_t& image, const camera_pose_t& pose, bool is_keyframe) {
  const double period_s = 1.0 / params_.view_rate_hz;
  const double since_s = (Time{image.utime} - last_view_).seconds();
  const bool due = since_s < 0 || since_s >= 0.9 * period_s;  // < 0: the camera's clock was set
  if (!due && !is_keyframe) return;
  last_view_ = {image.utime};
  view_t view{};
  view.utime = image.utime;
  view.pose = pose;
  view.is_keyframe = is_keyframe ? 1 : 0;
  view.image = image;
  views_.publish(view);
}

// An epoch is named by the frame with which it began, so that it stays unique across restarts; a
// map that outlived a slam is still the same.
void SlamProcess::update_epoch(Time time) {
  if (slam_->epoch() == core_epoch_) return;
  relocalised_.clear();
  core_epoch_ = slam_->epoch();
  in_kept_map_ = kept_epoch_.has_value();
  epoch_ = kept_epoch_.value_or(time.us);
  kept_epoch_.reset();
  epoch_is_sent_ = false;
}

void SlamProcess::publish_delta() {
  const MapDelta delta = slam_->take_delta();
  if (delta.empty()) return;
  data_time_ = last_image_;
  deltas_.send_delta(data_time_, epoch_, delta);
  epoch_is_sent_ = true;
  changed_since_kept_ = true;
}

void SlamProcess::continue_mapping() {
  if (node_.job_running() || start_file_job() || start_keeping()) return;
  auto job = slam_->take_job();
  if (!job) return;
  // std::function copies its callable, a MappingJob cannot be copied: shared pointers carry it.
  auto shared_job = std::make_shared<MappingJob>(std::move(*job));
  const Duration cost = seconds(params_.mapping_cost_s * shared_job->relative_cost());
  const bool started = node_.run_beside(
      [this, shared_job, generation = generation_]() -> std::function<void()> {
        auto result = std::make_shared<MappingResult>(Slam::run(std::move(*shared_job)));
        return [this, result, generation] {
          if (generation != generation_) return;  // the camera changed meanwhile
          slam_->apply(std::move(*result));
          publish_delta();
          continue_mapping();
        };
      },
      cost);
  static_cast<void>(started);  // job_running() was asked above
}

void SlamProcess::note_relocalisation(const TrackingResult& result) {
  if (result.relocalised) {
    char text[64] = "relocalised: had taken another place for this one";
    if (result.lost_s >= 0) {
      std::snprintf(text, sizeof text, "relocalised after %.1f s", result.lost_s);
    }
    relocalised_ = text;
    relocalised_at_ = node_.now();
  } else if (node_.now() - relocalised_at_ > kRelocalisedShown) {
    relocalised_.clear();
  }
}

void SlamProcess::publish_metrics(const TrackingResult& result) {
  const SlamStatistics s = slam_->statistics();
  node_.set_metric("keyframes", s.keyframes);
  node_.set_metric("points", s.points);
  node_.set_metric("published_points", s.published_points);
  node_.set_metric("forgotten_keyframes", s.forgotten_keyframes);
  node_.set_metric("memory_mb", s.memory_mb);
  node_.set_metric("losses", s.losses);
  node_.set_metric("relocalisations", s.relocalisations);
  node_.set_metric("restarts", s.restarts);
  node_.set_metric("focal_factor", s.focal_factor);
  node_.set_metric("quality", result.quality);
  if (!node_.is_simulated()) node_.set_metric("track_ms", track_ms_);  // no two runs are alike
  node_.set_metric("camera_infos_doubted", static_cast<double>(camera_.doubted()));
  const ImageStream::Losses losses = images_.losses(node_.now());
  node_.set_metric("images_lost", static_cast<double>(losses.lost));
  node_.set_metric("images_lost_share", losses.share());
  node_.set_metric("images_repeated", static_cast<double>(losses.repeated));
  node_.set_metric("image_source_changes", static_cast<double>(losses.source_changes));
}

// What is wrong though it tracks.
std::string SlamProcess::trouble() {
  std::string reasons = slam_->warning();
  append(&reasons, file_trouble_);
  append(&reasons, keep_trouble_);
  const ImageStream::Losses losses = images_.losses(node_.now());
  char text[96];
  if (losses.share() > kLossShown && losses.recently_lost >= kLossImages) {
    std::snprintf(text, sizeof text, "%lld of %lld images lost in the last 5 s",
                  static_cast<long long>(losses.recently_lost),
                  static_cast<long long>(losses.recently_lost + losses.recently_arrived));
    append(&reasons, text);
  }
  if (losses.recent_source_changes >= kSourceChanges) {
    append(&reasons, "images of several sources arrive: do two cameras publish IMAGE?");
  }
  if (camera_.doubted() > 0 && node_.now() - last_doubt_ <= kDoubtShown) {
    append(&reasons,
           "CAMERA_INFO contradicts itself, the first is believed: do two cameras publish it?");
  }
  return reasons;
}

void SlamProcess::publish_health(const TrackingResult& result) {
  publish_metrics(result);
  note_relocalisation(result);
  std::string reason;
  if (result.state == TrackingState::kInitialising) reason = "initialising: " + result.reason;
  if (result.state == TrackingState::kLost) reason = "lost: " + result.reason;
  append(&reason, trouble());
  if (result.state == TrackingState::kInitialising) {
    return node_.set_state(ProcessState::kWaiting, reason);
  }
  if (!reason.empty()) return node_.set_state(ProcessState::kDegraded, reason);
  node_.set_state(ProcessState::kOk, relocalised_);
}

}  // namespace foresight
