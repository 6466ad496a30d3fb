#include "bench/evaluate/closed_loop_scorer.h"

#include <algorithm>
#include <cmath>
#include <deque>

#include "bench/evaluate/image_scores.h"
#include "bench/evaluate/map_points.h"
#include "bench/evaluate/true_view.h"
#include "bench/evaluate/truth_track.h"
#include "common/image_codec.h"
#include "common/lcm_log.h"
#include "common/message_bytes.h"
#include "common/messages.h"
#include "common/robot_messages.h"
#include "foresight/controller_state_t.hpp"
#include "foresight/view_t.hpp"

namespace foresight {
namespace {

constexpr Duration kSettling = seconds(2);
constexpr double kDegrees = 180 / 3.14159265358979323846;

double yaw_deg(const Pose<World, Base>& pose) {
  const Eigen::Vector3d x = pose.rotation() * Eigen::Vector3d::UnitX();
  return std::atan2(x.y(), x.x()) * kDegrees;
}

// A predicted view that waits for the instant that it predicts.
struct Pending {
  PredictedPose pose;
  std::optional<PredictedFrame> frame;  // when its picture is to be scored
  ShownVideo shown;
};

class ClosedLoopScorer {
 public:
  ClosedLoopScorer(ClosedLoop& loop, const ClosedLoopOptions& options,
                   const ClosedLoopScoring& scoring, ClosedLoopResult* result)
      : loop_(loop),
        scoring_(scoring),
        result_(*result),
        sim_params_(Swarm::params<sim::SimProcess>(options.settings)),
        arm_(load_arm_file(sim_params_.arm_file)),
        pictures_(scoring.grid_rows) {
    listen(Domain::kRobot, "TRUTH_STATE", &ClosedLoopScorer::on_truth);
    listen(Domain::kRobot, "CAMERA_POSE", &ClosedLoopScorer::on_camera_pose);
    listen(Domain::kRobot, "ALIGNMENT", &ClosedLoopScorer::on_alignment);
    listen(Domain::kRobot, "BASE_POSE", &ClosedLoopScorer::on_base);
    listen(Domain::kRobot, "CONTROLLER_STATE", &ClosedLoopScorer::on_controller);
    listen(Domain::kRobot, "JOINT_STATE", &ClosedLoopScorer::on_joint_state);
    listen(Domain::kOperator, "JOINT_COMMAND", &ClosedLoopScorer::on_command);
    listen(Domain::kOperator, "CAMERA_INFO", &ClosedLoopScorer::on_camera_info);
    listen(Domain::kOperator, "VIEW", &ClosedLoopScorer::on_view);
    listen(Domain::kOperator, "DISPLAY_STATS", &ClosedLoopScorer::on_drawn);
    loop.world().listen(Domain::kRobot, "MAP_DELTA", [this](auto b) { map_.on_message(b); });
    loop.renderer().set_listener([this](const PredictedFrame& f) { on_prediction(f); });
  }

  void finish() {
    pictures_.finish(&result_);
    result_.map_points = map_.points();
    result_.keyframes = map_.keyframes();
    result_.triangles = loop_.renderer().triangles();
    result_.tracked_share = frames_ > 0 ? static_cast<double>(tracked_) / frames_ : 0;
    result_.scale_error = scale_error();
  }

 private:
  using Bytes = std::span<const uint8_t>;
  void listen(Domain domain, const char* channel, void (ClosedLoopScorer::*handler)(Bytes)) {
    loop_.world().listen(domain, channel, [this, handler](auto b) { (this->*handler)(b); });
  }
  double since_start_s(Time t) const { return (t - loop_.start()).seconds(); }

  void on_truth(Bytes bytes) {
    truth_.on_message(bytes);
    const auto& states = truth_.states();
    if (states.size() > 1) {
      const auto position = [](const Truth& t) {
        return (t.world_from_base.inverse() * t.world_from_cam).translation();
      };
      const Truth &a = states[states.size() - 2], &b = states.back();
      const double speed = (position(b) - position(a)).norm() / (b.time - a.time).seconds();
      result_.max_camera_speed_m_per_s = std::max(result_.max_camera_speed_m_per_s, speed);
    }
    score_due();
  }

  void on_camera_pose(Bytes bytes) {
    const auto message = decode<camera_pose_t>(bytes);
    const auto pose = read_pose(message);
    if (pose) has_started_ = true;
    frames_ += has_started_ ? 1 : 0;
    tracked_ += pose ? 1 : 0;
    if (!pose || !alignment_ || alignment_->epoch != message.epoch) return;
    const auto truth = truth_.at({message.utime});
    if (!truth) return;
    const Pose<World, Cam> estimated = alignment_->world_from_map * *pose;
    result_.alignment.push_back(error({message.utime}, truth->world_from_cam, estimated));
    if (paths_epoch_ != message.epoch) map_path_.clear(), true_path_.clear();
    paths_epoch_ = message.epoch;
    map_path_.push_back(pose->translation());
    true_path_.push_back(truth->world_from_cam.translation());
  }

  // The estimated world is the base's place when the map was first aligned.
  void on_alignment(Bytes bytes) {
    const auto message = decode<alignment_t>(bytes);
    alignment_ = read_alignment(message);
    if (!alignment_ || has_world_) return;
    const auto truth = truth_.at({message.utime});
    if (!truth) return;
    has_world_ = true;
    true_from_estimated_ =
        Pose<World, World>(truth->world_from_base.rotation(), truth->world_from_base.translation());
    aligned_at_ = loop_.world().now();
    result_.first_aligned_s = since_start_s(aligned_at_);
  }

  void on_base(Bytes bytes) {
    const auto base = read_base(decode<base_pose_t>(bytes));
    if (!base || !has_world_ || base->time < aligned_at_ + kSettling) return;
    const auto truth = truth_.at(base->time);
    if (!truth) return;
    const Pose<World, Base> estimated = true_from_estimated_ * base->world_from_base;
    const Pose<World, Base>& real = truth->world_from_base;
    PoseError e;
    e.time_s = since_start_s(base->time);
    e.position_mm = 1e3 * (estimated.translation() - real.translation()).norm();
    e.angle_deg = kDegrees * estimated.rotation().angularDistance(real.rotation());
    result_.base.push_back(e);
    BaseSample sample{e.time_s, {}, {}, yaw_deg(real), yaw_deg(estimated)};
    Eigen::Map<Eigen::Vector3d>(sample.true_m) = real.translation();
    Eigen::Map<Eigen::Vector3d>(sample.estimated_m) = estimated.translation();
    result_.base_path.push_back(sample);
  }

  void on_controller(Bytes bytes) {
    const auto message = decode<controller_state_t>(bytes);
    const bool is_fault = message.state == controller_state_t::STATE_FAULT;
    if (is_fault && !was_fault_) ++result_.controller_faults;
    was_fault_ = is_fault;
  }

  void on_joint_state(Bytes bytes) {
    const auto message = decode<joint_state_t>(bytes);
    if (message.command_utime == 0) return;
    command_delay_ = microseconds(message.command_arrival_utime - message.command_utime);
  }

  // What showing the commanded joints would have been worth, with the true base.
  void on_command(Bytes bytes) {
    const JointCommand command = read_command(decode<joint_command_t>(bytes));
    if (!command.is_engaged || command.position_rad.size() == 0 || !is_predicting_) return;
    commands_.push_back({command.time + command_delay_, arm_.base_from_cam(command.position_rad)});
  }

  void on_camera_info(Bytes bytes) {
    if (camera_) return;
    camera_ = from_message(decode<camera_info_t>(bytes));
    if (!camera_) return;
    undistort_.emplace(*camera_);
    view_ = std::make_unique<TrueView>(sim_params_, *camera_);
  }

  void on_view(Bytes bytes) {
    const auto message = decode<view_t>(bytes);
    const auto image = decode_image(message.image, 3);
    if (!image || !undistort_) return;
    shown_ = {{message.utime},
              (*undistort_)(to_mat(*image)),
              read_pose(message.pose),
              message.pose.epoch};
  }

  void on_drawn(Bytes) { result_.drawn_frames += is_predicting_ ? 1 : 0; }

  void on_prediction(const PredictedFrame& frame) {
    if (!has_world_ || shown_.picture.rgb.empty()) return;
    if (!is_predicting_) {
      is_predicting_ = true;
      result_.first_prediction_s = since_start_s(loop_.world().now());
    }
    Pending pending{frame.pose, {}, {}};
    if (result_.predicted_frames++ % scoring_.every == 0) {
      pending.frame = frame;
      pending.shown = shown_;
    }
    pending_.push_back(std::move(pending));
  }

  void score_due() {
    while (!pending_.empty()) {
      const auto truth = truth_.at(pending_.front().pose.instant);
      if (!truth) break;
      score(pending_.front(), *truth);
      pending_.pop_front();
    }
    while (!commands_.empty()) {
      const auto truth = truth_.at(commands_.front().first);
      if (!truth) break;
      const Pose<World, Cam> shown = truth->world_from_base * commands_.front().second;
      result_.commands.push_back(
          error(commands_.front().first, truth->world_from_cam, shown, true));
      commands_.pop_front();
    }
  }

  void score(const Pending& p, const Truth& truth) {
    const Pose<World, Cam> predicted = true_from_estimated_ * p.pose.world_from_cam;
    result_.predictions.push_back(error(p.pose.instant, truth.world_from_cam, predicted, true));
    if (!p.frame) return;
    pictures_.score(whole(view_->picture(truth.world_from_cam)), p.shown, *p.frame,
                    map_.positions_in_map());
  }

  PoseError error(Time time, const Pose<World, Cam>& truth, const Pose<World, Cam>& estimated,
                  bool with_shift = false) const {
    PoseError e;
    e.time_s = since_start_s(time);
    e.position_mm = 1e3 * (truth.translation() - estimated.translation()).norm();
    e.angle_deg = kDegrees * truth.rotation().angularDistance(estimated.rotation());
    if (with_shift && view_) e.shift_px = view_->shift_px(truth, estimated);
    return e;
  }

  // Against the similarity that fits the whole path best.
  double scale_error() const {
    if (!alignment_ || map_path_.size() < 3) return std::nan("");
    const auto count = static_cast<Eigen::Index>(map_path_.size());
    Eigen::Matrix3Xd map(3, count), real(3, count);
    for (Eigen::Index i = 0; i < count; ++i) {
      map.col(i) = map_path_[static_cast<size_t>(i)];
      real.col(i) = true_path_[static_cast<size_t>(i)];
    }
    const Eigen::Matrix4d fit = Eigen::umeyama(map, real, true);
    return alignment_->world_from_map.scale() / fit.topLeftCorner<3, 3>().col(0).norm() - 1;
  }

  ClosedLoop& loop_;
  ClosedLoopScoring scoring_;
  ClosedLoopResult& result_;
  sim::SimParams sim_params_;
  ArmModel arm_;
  PictureScorer pictures_;
  TruthTrack truth_;
  MapPoints map_;
  std::optional<CameraModel> camera_;
  std::optional<Undistorter> undistort_;
  std::unique_ptr<TrueView> view_;
  std::optional<Alignment> alignment_;
  Pose<World, World> true_from_estimated_;
  Time aligned_at_;
  bool has_world_ = false, has_started_ = false, is_predicting_ = false, was_fault_ = false;
  int frames_ = 0, tracked_ = 0;
  int64_t paths_epoch_ = 0;
  std::vector<Eigen::Vector3d> map_path_, true_path_;
  Duration command_delay_;
  ShownVideo shown_;
  std::deque<Pending> pending_;
  std::deque<std::pair<Time, Pose<Base, Cam>>> commands_;
};

// Everything that is published, as lcm-logger would record it.
class TrafficLog {
 public:
  TrafficLog(ClosedLoop& loop, const std::string& folder)
      : robot_(folder + "/robot.lcmlog"), operator_(folder + "/operator.lcmlog") {
    loop.world().set_tap([this](Time time, Domain domain, const std::string& channel, auto bytes) {
      (domain == Domain::kRobot ? robot_ : operator_).write(time, channel, bytes);
    });
  }
  void close() {
    robot_.close();
    operator_.close();
  }

 private:
  LogWriter robot_, operator_;
};

}  // namespace

ClosedLoopResult evaluate(const ClosedLoopOptions& options, const ClosedLoopScoring& scoring,
                          const std::function<void(double)>& progress) {
  ClosedLoopResult result;
  result.delay_s = options.delay_s;
  result.seconds = options.seconds;
  ClosedLoop loop(options);
  ClosedLoopScorer scorer(loop, options, scoring, &result);
  std::optional<TrafficLog> log;
  if (!scoring.log_folder.empty()) log.emplace(loop, scoring.log_folder);
  double reported_s = 0;
  while (loop.step()) {
    const double now_s = (loop.world().now() - loop.start()).seconds();
    if (now_s < reported_s + 1) continue;
    reported_s = now_s;
    progress(now_s / options.seconds);
  }
  scorer.finish();
  if (log) log->close();
  return result;
}

}  // namespace foresight
