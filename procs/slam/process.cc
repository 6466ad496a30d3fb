#include "procs/slam/process.h"

#include <cstdio>
#include <exception>

#include "common/image_codec.h"
#include "common/messages.h"
#include "procs/slam/map_folder.h"

namespace foresight {
namespace {
constexpr Duration kRelocalisedShown = seconds(3);  // in the health, which comes once a second
}

SlamProcess::SlamProcess(Node& node, const SlamParams& params)
    : node_(node),
      params_(params),
      poses_(node.advertise<camera_pose_t>(
          {.channel = "CAMERA_POSE", .rate_hz = 30, .doc = "pose of every frame, or why not"})),
      views_(node.advertise<view_t>(
          {.channel = "VIEW", .rate_hz = params.view_rate_hz, .doc = "frame with its pose"})),
      deltas_(node.advertise<map_delta_t>(
                  {.channel = "MAP_DELTA", .doc = "changed keyframes, points and observations"}),
              node.now()) {
  if (!params.map_folder.empty()) start_map_ = read_map_folder(params.map_folder);
  node.subscribe<camera_info_t>({.channel = "CAMERA_INFO", .rate_hz = 1, .doc = "intrinsics"},
                                Queue::kLatest,
                                [this](const camera_info_t& m) { on_camera_info(m); });
  node.subscribe<image_t>({.channel = "IMAGE", .rate_hz = 30, .doc = "frames"}, Queue::kLatest,
                          [this](const image_t& m) { on_image(m); });
  node.subscribe<slam_command_t>(
      {.channel = "SLAM_COMMAND", .doc = "orders: save, load or reset the map"}, Queue::kAll,
      [this](const slam_command_t& m) { on_command(m); });
  node.subscribe<pose_hint_t>(
      {.channel = "POSE_HINT", .doc = "where the arm says that the camera is", .optional = true},
      Queue::kLatest, [this](const pose_hint_t& m) { on_hint(m); });
  node.subscribe<snapshot_request_t>(
      {.channel = "SNAPSHOT_REQUEST", .doc = "asks for the whole map"}, Queue::kAll,
      [this](const snapshot_request_t& m) { on_request(m); });
  node.every(seconds(1), "input watch", [this] {
    if (node_.now() - last_arrival_ <= seconds(1)) return;
    const bool rejecting = node_.now() - last_rejection_ <= seconds(1);
    node_.set_state(ProcessState::kWaiting, !camera_ ? "no CAMERA_INFO yet"
                                            : rejecting
                                                ? "every IMAGE is rejected: it " + rejection_
                                                : "no IMAGE arrives");
  });
}

void SlamProcess::on_camera_info(const camera_info_t& message) {
  const auto camera = from_message(message);
  if (!camera) return node_.reject_message("CAMERA_INFO", "makes no sense as intrinsics");
  if (camera_ && *camera == *camera_) return;
  camera_ = camera;
  slam_ = std::make_unique<Slam>(*camera_, params_.options);
  core_epoch_ = -1;
  ++generation_;
  drop_loads();
  if (start_map_ && take_over(*start_map_, params_.map_folder)) start_map_.reset();
}

bool SlamProcess::take_over(const StoredMap& stored, const std::string& folder) {
  if (!(stored.camera == *camera_)) {
    report_trouble(folder + ": a map of another camera");
    return false;
  }
  slam_->restore(stored);
  return true;
}

// What is wrong with a save or load stays in the health until the next order.
void SlamProcess::report_trouble(const std::string& trouble) {
  file_trouble_ = trouble;
  node_.reject_message("SLAM_COMMAND", trouble);
}

void SlamProcess::on_image(const image_t& message) {
  if (!slam_) return;  // CAMERA_INFO comes first; "input watch" says so when it does not
  // After a second of stamps that do not increase, the camera's new clock is believed.
  if (message.utime <= last_image_.us && node_.now() - last_arrival_ < seconds(1)) {
    return reject("time-stamp does not increase");
  }
  const auto image = decode_image(message, 1);
  if (!image) return reject("is damaged");
  if (image->width_px != camera_->width_px || image->height_px != camera_->height_px) {
    return reject("has not the size that CAMERA_INFO gives");
  }
  last_image_ = {message.utime};
  last_arrival_ = node_.now();
  const TrackingResult result = slam_->track(
      last_image_, {image->bytes.data(), image->width_px, image->height_px, image->width_px});
  update_epoch(last_image_);
  const camera_pose_t pose = to_message(result);
  poses_.publish(pose);
  publish_view(message, pose, result.is_keyframe);
  publish_delta();
  continue_mapping();
  publish_health(result);
}

void SlamProcess::reject(const char* why) {
  rejection_ = why;
  last_rejection_ = node_.now();
  node_.reject_message("IMAGE", why);
}

void SlamProcess::on_command(const slam_command_t& command) {
  const bool save = command.command == slam_command_t::COMMAND_SAVE_MAP;
  const bool load = command.command == slam_command_t::COMMAND_LOAD_MAP;
  const bool reset = command.command == slam_command_t::COMMAND_RESET_MAP;
  if (!save && !load && !reset) {
    return node_.reject_message("SLAM_COMMAND", "is no order that slam knows");
  }
  if (!slam_) return node_.reject_message("SLAM_COMMAND", "comes before CAMERA_INFO");
  if (!reset && !command.folder.starts_with("/")) {
    return node_.reject_message("SLAM_COMMAND", "needs an absolute folder");
  }
  file_trouble_.clear();
  if (reset) {
    drop_loads();
    slam_->reset("reset by command");
    return;
  }
  FileOrder order{save, command.folder, {}, load_mark_};
  if (save) order.map = slam_->stored_map();  // as it is now; images are shared
  file_orders_.push_back(std::move(order));
  continue_mapping();
}

// A map that was asked for before a reset or a new camera is not wanted any more.
void SlamProcess::drop_loads() {
  std::erase_if(file_orders_, [](const FileOrder& o) { return !o.save; });
  ++load_mark_;
}

void SlamProcess::on_hint(const pose_hint_t& hint) {
  const auto pose = read_pose(hint);
  if (!pose) return node_.reject_message("POSE_HINT", "its pose is none");
  if (!slam_ || hint.epoch != epoch_) return;  // of another map
  slam_->hint({hint.utime}, *pose);
}

void SlamProcess::on_request(const snapshot_request_t& request) {
  if (request.channel == "MAP_DELTA" && slam_ && epoch_is_sent_) {
    deltas_.send_snapshot(data_time_, slam_->snapshot());
  }
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

// An epoch is named by the frame with which it began, so that it stays unique across restarts.
void SlamProcess::update_epoch(Time time) {
  if (slam_->epoch() == core_epoch_) return;
  relocalised_.clear();
  core_epoch_ = slam_->epoch();
  epoch_ = time.us;
  epoch_is_sent_ = false;
}

void SlamProcess::publish_delta() {
  const MapDelta delta = slam_->take_delta();
  if (delta.empty()) return;
  data_time_ = last_image_;
  deltas_.send_delta(data_time_, epoch_, delta);
  epoch_is_sent_ = true;
}

void SlamProcess::continue_mapping() {
  if (node_.job_running() || start_file_job()) return;
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

// Reading and writing a map folder takes a second: beside the loop. True if one was started.
bool SlamProcess::start_file_job() {
  if (file_orders_.empty()) return false;
  auto order = std::make_shared<FileOrder>(std::move(file_orders_.front()));
  file_orders_.pop_front();
  return node_.run_beside(
      [this, order]() -> std::function<void()> {
        std::string trouble;
        try {
          if (order->save) {
            write_map_folder(order->map, order->folder);
          } else {
            order->map = read_map_folder(order->folder);
          }
        } catch (const std::exception& error) {  // the file system's and the image library's too
          trouble = error.what();
        }
        return [this, order, trouble] {
          if (!trouble.empty()) {
            report_trouble(trouble);
          } else if (!order->save && order->load_mark == load_mark_) {
            take_over(order->map, order->folder);
          }
          continue_mapping();
        };
      },
      seconds(1));
}

void SlamProcess::note_relocalisation(const TrackingResult& result) {
  if (result.relocalised) {
    char text[64] = "relocalised: had taken another place for this one";
    if (result.lost_s > 0) {
      std::snprintf(text, sizeof text, "relocalised after %.1f s", result.lost_s);
    }
    relocalised_ = text;
    relocalised_at_ = node_.now();
  } else if (node_.now() - relocalised_at_ > kRelocalisedShown) {
    relocalised_.clear();
  }
}

void SlamProcess::publish_health(const TrackingResult& result) {
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
  const auto with_trouble = [this](const std::string& reason) {
    if (file_trouble_.empty()) return reason;
    return reason.empty() ? file_trouble_ : reason + "; " + file_trouble_;
  };
  note_relocalisation(result);
  switch (result.state) {
    case TrackingState::kTracking: {
      const std::string trouble = with_trouble(slam_->warning());
      if (!trouble.empty()) return node_.set_state(ProcessState::kDegraded, trouble);
      return node_.set_state(ProcessState::kOk, relocalised_);
    }
    case TrackingState::kInitialising:
      return node_.set_state(ProcessState::kWaiting,
                             with_trouble("initialising: " + result.reason));
    case TrackingState::kLost:
      return node_.set_state(ProcessState::kDegraded, with_trouble("lost: " + result.reason));
  }
}

}  // namespace foresight
