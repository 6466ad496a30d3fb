#include "procs/camera/process.h"

#include "common/messages.h"
#include "procs/camera/camera_choice.h"

namespace foresight {
namespace {

constexpr Duration kFirstFrameDelay = milliseconds(100);

}  // namespace

CameraProcess::CameraProcess(Node& node, const CameraParams& params)
    : node_(node),
      params_(params),
      images_(node.advertise<image_t>(
          {.channel = "IMAGE", .rate_hz = 30, .doc = "frames at the camera's rate"})),
      infos_(node.advertise<camera_info_t>(
          {.channel = "CAMERA_INFO", .rate_hz = 1, .doc = "intrinsics of IMAGE"})) {
  node.every(seconds(1), "camera info", [this] { publish_info(); });
  if (params_.pace == Pace::kConsumed) {
    node.subscribe<camera_pose_t>({.channel = "CAMERA_POSE", .doc = "slam's answer to a frame"},
                                  Queue::kAll, [this](const camera_pose_t& m) { on_pose(m); });
    node.every(seconds(2), "stall", [this] { on_stall(); });
  }
}

void CameraProcess::start() {
  source_ = open_frame_source(params_.source);
  Picture picture;
  std::optional<Frame> first = first_usable_frame(&picture);
  const ChosenCamera chosen = choose_camera(params_.source, params_.camera_file,
                                            picture.image.width_px, picture.image.height_px);
  guessed_ = chosen.is_guessed;
  converter_ = std::make_unique<FrameConverter>(chosen.camera, params_);
  report_.note(source_->note());
  report_.note(chosen.note);
  for (const std::string& note : report_.notes()) note_ += (note_.empty() ? "" : "; ") + note;
  node_.set_state(guessed_ ? ProcessState::kDegraded : ProcessState::kOk, note_);
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

// Those before it that cannot be used are counted.
std::optional<Frame> CameraProcess::first_usable_frame(Picture* picture) {
  std::optional<Frame> frame = skip_to_first_frame();
  if (!frame && params_.first_frame > 0 && source_->error().empty()) {
    throw ConfigError("first_frame: " + params_.source + " has fewer frames");
  }
  for (; frame; frame = source_->next()) {
    *picture = picture_of(*frame, 3);
    if (picture->error.empty()) return frame;
    report_.refuse(frame->name, picture->error);
  }
  const std::string why = source_->error().empty() ? report_.complaint() : source_->error();
  throw UnavailableError("source: " + params_.source + ": no frame: " + why);
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
  if (params_.stamps == Stamps::kOriginal) return frame.time;
  const double elapsed_s = (frame.time - first_stamp_).seconds() / params_.speed;
  return base_ + seconds(elapsed_s);
}

void CameraProcess::publish_recorded() {
  if (!began_) {
    began_ = true;
    first_stamp_ = next_->time;
    base_ = node_.now();
  }
  const bool is_out = publish(*next_, stamp_of(*next_));
  if (ended_) return;
  prepare_next();
  // Nobody will answer to a frame that was refused.
  if (!is_out && next_ && params_.pace == Pace::kConsumed) {
    node_.at(node_.now(), [this] { publish_recorded(); });
  }
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
  if (!next_) {
    report_.end(source_->shortfall());
    return end_of_source();
  }
  if (params_.pace == Pace::kReal) schedule();
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
  const std::string complaint = report_.complaint();
  const ExitCode code = complaint.empty() ? kExitDone : kExitUnavailable;
  node_.finish("end of " + params_.source + (complaint.empty() ? "" : ": " + complaint),
               params_.exit_at_end ? std::optional(code) : std::nullopt);
}

void CameraProcess::refuse(const Frame& frame, const std::string& why) {
  report_.refuse(frame.name, why);
  node_.set_metric("refused_frames", report_.refused());
  node_.set_state(ProcessState::kDegraded, frame.name + ": " + why);
}

bool CameraProcess::publish(const Frame& frame, Time time) {
  std::optional<image_t> message = converter_->convert(frame);
  if (!message) {
    refuse(frame, converter_->error());
    return false;
  }
  report_.use();
  if (!converter_->warning().empty()) report_.warn(frame.name, converter_->warning());
  if (!guessed_ && node_.state() != ProcessState::kOk) node_.set_state(ProcessState::kOk, note_);
  message->utime = time.us;
  message->frame_number = params_.first_frame + published_;
  last_published_ = time;
  images_.publish(*message);
  node_.set_metric("frames", ++published_);
  if (published_ == params_.frame_count) end_of_source();
  return true;
}

}  // namespace foresight
