#include "procs/camera/process.h"

#include <turbojpeg.h>

#include <algorithm>
#include <filesystem>
#include <tuple>

#include "common/messages.h"

namespace foresight {
namespace {

constexpr Duration kFirstFrameDelay = milliseconds(100);

// Width and height of a frame, decoded or not.
std::pair<int, int> size_of(const Frame& frame) {
  if (frame.jpeg.empty()) return {frame.image.width_px, frame.image.height_px};
  int width = 0, height = 0, subsampling = 0, colourspace = 0;
  tjhandle handle = tjInitDecompress();
  tjDecompressHeader3(handle, frame.jpeg.data(), static_cast<unsigned long>(frame.jpeg.size()),
                      &width, &height, &subsampling, &colourspace);
  tjDestroy(handle);
  return {width, height};
}

}  // namespace

CameraProcess::CameraProcess(Node& node, const CameraParams& params)
    : node_(node),
      params_(params),
      images_(node.advertise<image_t>(
          {.channel = "IMAGE", .rate_hz = 30, .doc = "frames at the camera's rate"})),
      infos_(node.advertise<camera_info_t>(
          {.channel = "CAMERA_INFO", .rate_hz = 1, .doc = "intrinsics of IMAGE"})) {
  node.every(seconds(1), "camera info", [this] { publish_info(); });
  if (params_.pace == "consumed") {
    node.subscribe<camera_pose_t>({.channel = "CAMERA_POSE", .doc = "slam's answer to a frame"},
                                  Queue::kAll, [this](const camera_pose_t& m) { on_pose(m); });
    node.every(seconds(2), "stall", [this] { on_stall(); });
  }
}

void CameraProcess::start() {
  source_ = open_frame_source(params_.source);
  std::optional<Frame> first = skip_to_first_frame();
  if (!first && params_.first_frame > 0 && source_->error().empty()) {
    throw ConfigError("first_frame: " + params_.source + " has fewer frames");
  }
  if (!first)
    throw UnavailableError("source: " + params_.source + ": no frame: " + source_->error());
  const CameraModel camera = choose_camera(*first);
  if (size_of(*first) != std::pair(camera.width_px, camera.height_px)) {
    throw ConfigError("camera_file: is for " + std::to_string(camera.width_px) + "x" +
                      std::to_string(camera.height_px) + " px, the source has " +
                      std::to_string(size_of(*first).first) + "x" +
                      std::to_string(size_of(*first).second));
  }
  converter_ = std::make_unique<FrameConverter>(camera, params_);
  node_.set_state(guessed_ ? ProcessState::kDegraded : ProcessState::kOk,
                  guessed_ ? "intrinsics are guessed: give camera_file" : "");
  node_.at(node_.now(), [this] { publish_info(); });
  if (source_->is_live()) {
    node_.at(node_.now(), [this] { read_device(); });
  } else {
    next_ = std::move(first);
    node_.at(node_.now() + kFirstFrameDelay, [this] { publish_recorded(); });
  }
}

std::optional<Frame> CameraProcess::skip_to_first_frame() {
  std::optional<Frame> frame = source_->next();
  for (int i = 0; frame && i < params_.first_frame; ++i) frame = source_->next();
  return frame;
}

CameraModel CameraProcess::choose_camera(const Frame& first) {
  if (!params_.camera_file.empty()) return load_camera_file(params_.camera_file);
  const std::string beside = params_.source + "/camera.yaml";
  if (std::filesystem::exists(beside)) return load_camera_file(beside);
  guessed_ = true;
  CameraModel camera;
  std::tie(camera.width_px, camera.height_px) = size_of(first);
  camera.fx_px = camera.fy_px = 0.9 * std::max(camera.width_px, camera.height_px);  // about 58°
  camera.cx_px = 0.5 * (camera.width_px - 1);
  camera.cy_px = 0.5 * (camera.height_px - 1);
  camera.prepare();
  return camera;
}

void CameraProcess::publish_info() {
  if (converter_) infos_.publish(to_message(converter_->output_camera(), node_.now()));
}

// A device blocks until its next frame: it is read beside the main thread.
void CameraProcess::read_device() {
  const bool started = node_.run_beside(
      [this, source = source_]() -> std::function<void()> {
        auto frame = std::make_shared<std::optional<Frame>>(source->next());
        return [this, frame] {
          if (*frame) {
            publish(**frame, node_.now());
            if (!ended_) read_device();
          } else {
            node_.set_state(ProcessState::kWaiting, source_->error());
            node_.at(node_.now() + seconds(1), [this] { read_device(); });
          }
        };
      },
      Duration{0});
  static_cast<void>(started);  // only this function starts jobs, one after the other
}

Time CameraProcess::stamp_of(const Frame& frame) {
  if (params_.stamps == "original") return frame.time;
  const double elapsed_s = (frame.time - first_stamp_).seconds() / params_.speed;
  return base_ + seconds(elapsed_s);
}

void CameraProcess::publish_recorded() {
  if (!began_) {
    began_ = true;
    first_stamp_ = next_->time;
    base_ = node_.now();
  }
  publish(*next_, stamp_of(*next_));
  if (ended_) return;
  prepare_next();
}

void CameraProcess::prepare_next() {
  const Time last = next_->time;
  next_ = source_->next();
  if (!next_ && source_->error().empty() && params_.loop) {
    source_->rewind();
    next_ = skip_to_first_frame();
    // The next pass goes on where this one ends, one frame later.
    base_ = base_ + seconds((last - first_stamp_).seconds() / params_.speed) + milliseconds(33);
    first_stamp_ = next_ ? next_->time : last;
  }
  if (!next_) return end_of_source();
  if (params_.pace == "real") schedule();
}

void CameraProcess::schedule() {
  const double elapsed_s = (next_->time - first_stamp_).seconds() / params_.speed;
  node_.at(base_ + seconds(elapsed_s), [this] { publish_recorded(); });
}

void CameraProcess::on_pose(const camera_pose_t& pose) {
  if (pose.utime == last_published_.us && next_ && !ended_) publish_recorded();
}

// Nobody answered for a while (slam restarted, say): go on rather than wait for ever.
void CameraProcess::on_stall() {
  if (began_ && next_ && !ended_ && published_ == stall_mark_) publish_recorded();
  stall_mark_ = published_;
}

void CameraProcess::end_of_source() {
  ended_ = true;
  const std::string error = source_->error();
  if (!error.empty()) {
    node_.set_state(ProcessState::kFailed, error);
    return;
  }
  node_.finish("end of " + params_.source, params_.exit_at_end);
}

void CameraProcess::publish(const Frame& frame, Time time) {
  std::optional<image_t> message = converter_->convert(frame);
  if (!message) {
    node_.set_metric("damaged_frames", ++failed_);
    node_.set_state(ProcessState::kDegraded, converter_->error());
    return;
  }
  if (!guessed_ && node_.state() != ProcessState::kOk) node_.set_state(ProcessState::kOk, "");
  message->utime = time.us;
  message->frame_number = params_.first_frame + published_;
  last_published_ = time;
  images_.publish(*message);
  node_.set_metric("frames", ++published_);
  if (published_ == params_.frame_count) end_of_source();
}

}  // namespace foresight
