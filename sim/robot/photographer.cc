#include "sim/robot/photographer.h"

#include <algorithm>
#include <cmath>

#include "common/check.h"
#include "common/messages.h"
#include "common/robot_messages.h"

namespace foresight::sim {
namespace {

// What moves less than this while the shutter is open needs no blur.
constexpr double kSharp_px = 0.5;
constexpr double kMinPoses = 4, kMaxPoses = 8;
constexpr double kTypicalDistance_m = 1;

// How far the picture moves between two poses, about.
double shift_px(const Pose<World, Cam>& a, const Pose<World, Cam>& b, double focal_px) {
  const double turn_rad = a.rotation().angularDistance(b.rotation());
  const double way_m = (a.translation() - b.translation()).norm();
  return focal_px * (turn_rad + way_m / kTypicalDistance_m);
}

}  // namespace

truth_t to_message(const RobotTruth& truth, Time time) {
  truth_t message{};
  message.utime = time.us;
  write_transform(truth.world_from_base, message.world_from_base_quat_wxyz,
                  message.world_from_base_position_m);
  write_transform(truth.world_from_cam, message.world_from_cam_quat_wxyz,
                  message.world_from_cam_position_m);
  message.joint_position_rad = write_joints(truth.arm.position_rad);
  message.joint_velocity_rad_per_s = write_joints(truth.arm.velocity_rad_per_s);
  message.n_joints = static_cast<int32_t>(message.joint_position_rad.size());
  return message;
}

Photographer::Photographer(Node& node, const SimParams& params)
    : node_(node),
      latency_(seconds(params.camera_latency_s)),
      shutter_(seconds(params.camera_shutter_s)),
      rate_hz_(params.camera_rate_hz),
      images_(node.advertise<image_t>({.channel = "IMAGE",
                                       .rate_hz = params.camera_rate_hz,
                                       .doc = "what the camera in the hand sees"})),
      infos_(node.advertise<camera_info_t>(
          {.channel = "CAMERA_INFO", .rate_hz = 1, .doc = "intrinsics of IMAGE"})),
      truths_(node.advertise<truth_t>({.channel = "TRUTH_FRAME",
                                       .rate_hz = params.camera_rate_hz,
                                       .doc = "the truth at the instant of each frame"})) {}

void Photographer::start(std::shared_ptr<CameraRig> rig, Time now, std::function<void()> on_done) {
  rig_ = std::move(rig);
  on_done_ = std::move(on_done);
  start_ = next_info_ = now;
}

Time Photographer::middle_of(int64_t frame) const {
  return start_ + seconds(static_cast<double>(frame + 1) / rate_hz_);
}

Time Photographer::end_of(int64_t frame) const {
  return middle_of(frame) + microseconds(shutter_.us / 2);
}

void Photographer::on_tick(const Robot& robot) {
  while (end_of(next_frame_) <= robot.now()) expose(robot);
  publish_due(robot.now());
  if (robot.now() >= next_info_) {
    infos_.publish(foresight::to_message(rig_->model(), robot.now()));
    next_info_ = next_info_ + seconds(1);
  }
}

std::vector<Pose<World, Cam>> Photographer::poses_while_open(const Robot& robot,
                                                             Time middle) const {
  const auto pose_at = [&](double share) {  // of the exposure, from −0.5 to 0.5
    const auto offset_us = std::llround(share * static_cast<double>(shutter_.us));
    return robot.truth_at(middle + microseconds(offset_us)).world_from_cam;
  };
  const double blur_px = shift_px(pose_at(-0.5), pose_at(0.5), rig_->model().fx_px);
  if (blur_px < kSharp_px) return {pose_at(0)};
  const auto count = static_cast<int>(std::clamp(std::ceil(blur_px), kMinPoses, kMaxPoses));
  std::vector<Pose<World, Cam>> poses;
  poses.reserve(static_cast<size_t>(count));
  for (int i = 0; i < count; ++i) poses.push_back(pose_at((i + 0.5) / count - 0.5));
  return poses;
}

// The job holds the rig and the picture, not this object's state; its result comes back to the main
// thread.
void Photographer::expose(const Robot& robot) {
  const Time middle = middle_of(next_frame_);
  const auto number = static_cast<int32_t>(next_frame_++);
  if (node_.job_running()) {
    ++skipped_;
    return;
  }
  pictures_.push_back({middle + latency_, to_message(robot.truth_at(middle), middle), nullptr});
  const Time begin = node_.now();
  const bool started = node_.run_beside(
      [this, rig = rig_, poses = poses_while_open(robot, middle), number, begin,
       utime = middle.us]() -> std::function<void()> {
        auto image = std::make_shared<image_t>(rig->take(poses, number));
        image->utime = utime;
        return [this, image, begin] {
          pictures_.back().image = image;
          render_time_ = render_time_ + (node_.now() - begin);
          ++renders_;
          on_done_();
        };
      },
      Duration{0});  // on a simulated clock too the latency is what delays a picture
  FORESIGHT_CHECK(started);
}

void Photographer::publish_due(Time now) {
  while (!pictures_.empty() && pictures_.front().image && pictures_.front().due <= now) {
    truths_.publish(pictures_.front().truth);
    images_.publish(*pictures_.front().image);
    pictures_.pop_front();
    ++published_;
  }
}

bool Photographer::is_late_for(Time next_tick) const {
  if (pictures_.empty() || pictures_.back().image) return false;
  return pictures_.back().due <= next_tick || end_of(next_frame_) <= next_tick;
}

double Photographer::take_render_ms() {
  const double mean_ms = renders_ == 0 ? 0 : 1e3 * render_time_.seconds() / double(renders_);
  render_time_ = {0};
  renders_ = 0;
  return mean_ms;
}

}  // namespace foresight::sim
