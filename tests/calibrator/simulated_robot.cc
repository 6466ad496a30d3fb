#include "tests/calibrator/simulated_robot.h"

#include <algorithm>
#include <cmath>

#include "procs/calibrator/alignment_solver.h"
#include "procs/calibrator/geometry.h"

namespace foresight {
namespace {

using calibration::kDegree;
using calibration::rotation_from_vector;
using Eigen::Vector3d;

constexpr Duration kTick = milliseconds(10), kFramePeriod = microseconds(33'333);
constexpr Duration kFrameLatency = milliseconds(20);
constexpr double kKeyframeDistance_m = 0.05, kKeyframeTurn_rad = 10 * kDegree;

}  // namespace

SimulatedRobot::SimulatedRobot(const ArmModel& arm, const RobotOptions& options)
    : arm_(arm), options_(options), generator_(options.seed) {
  if (!options_.base) options_.base = [](double) { return Pose<World, Base>(); };
  camera_.width_px = 640;
  camera_.height_px = 480;
  camera_.fx_px = camera_.fy_px = 530;
  camera_.cx_px = 319.5;
  camera_.cy_px = 239.5;
  make_points();
  begin_map(options_.scale_m_per_mu);
}

Vector3d SimulatedRobot::gaussian(double sigma3) {
  const double x = normal_(generator_), y = normal_(generator_), z = normal_(generator_);
  return sigma3 / std::sqrt(3.0) * Vector3d(x, y, z);
}

// A cloud one to two metres in front of the camera's home.
void SimulatedRobot::make_points() {
  const Pose<World, Cam> home = options_.base(0) * arm_.base_from_cam(arm_.home());
  for (int i = 0; i < 1500; ++i) {
    const Vector3d g = gaussian(std::sqrt(3.0));
    points_in_world_.push_back(home * Vector3d(1.2 * g.x(), 1.2 * g.y(), 1.6 + 0.25 * g.z()));
  }
}

void SimulatedRobot::begin_map(double scale_m_per_mu) {
  const Vector3d turn = gaussian(2), shift = gaussian(1);
  world_from_map_ = {scale_m_per_mu, rotation_from_vector(turn), shift};
  epoch_ = now_.us;
  keyframes_.clear();
}

JointVector SimulatedRobot::joints(double t_s) const {
  JointVector q = arm_.home();
  for (int i = 0; i < q.size(); ++i) {
    q[i] += options_.joint_swing_rad * std::sin((0.7 + 0.23 * i) * t_s + i);
  }
  return q;
}

// The arm's phase runs with time while it moves; images and joints share it.
Pose<World, Cam> SimulatedRobot::world_from_cam(Time image_time) const {
  const auto after = std::upper_bound(arm_clock_.begin(), arm_clock_.end(), image_time,
                                      [](Time t, const auto& entry) { return t < entry.first; });
  const auto& [time, phase_s] = after == arm_clock_.begin() ? *after : *(after - 1);
  const double since_s = arm_is_still_ ? 0 : (image_time - time).seconds();
  return options_.base(seconds_of(image_time)) * arm_.base_from_cam(joints(phase_s + since_s));
}

Pose<Map, Cam> SimulatedRobot::seen(Time time, double noise_share) {
  const Pose<World, Cam> truth = world_from_cam(time);
  const Vector3d shift = gaussian(noise_share * options_.noise_m);
  const Vector3d turn = gaussian(noise_share * options_.noise_deg * kDegree);
  const Pose<World, Cam> noisy(truth.rotation() * rotation_from_vector(turn),
                               truth.translation() + shift);
  return world_from_map_.inverse() * noisy;
}

void SimulatedRobot::maybe_make_keyframe(Time time, RobotListener* listener) {
  const Pose<World, Cam> here = world_from_cam(time);
  for (const Pose<World, Cam>& k : keyframes_) {
    if ((k.translation() - here.translation()).norm() < kKeyframeDistance_m &&
        calibration::angle_between(k.rotation(), here.rotation()) < kKeyframeTurn_rad) {
      return;
    }
  }
  MapDelta delta;
  const bool is_first = keyframes_.empty();
  if (is_first) {
    for (size_t i = 0; i < points_in_world_.size(); ++i) {
      const Vector3d p = world_from_map_.inverse() * points_in_world_[i];
      delta.points_set.push_back({PointId::at(i), p.cast<float>()});
    }
  }
  Pose<Map, Cam> pose = seen(time, 2.0 / 3);
  const double chance = std::uniform_real_distribution<double>(0, 1)(generator_);
  if (chance < options_.wrong_keyframe_share) {
    pose = {pose.rotation(), pose.translation() + gaussian(0.2) / world_from_map_.scale()};
  }
  delta.keyframes_set.push_back({KeyframeId::at(keyframes_.size()), pose, time});
  keyframes_.push_back(here);
  listener->on_map(epoch_, is_first, delta);
}

void SimulatedRobot::see_frame(Time time, RobotListener* listener) {
  calibration::CameraFrame frame{time, epoch_, seen(time, 1), 0.9, 300};
  if (tracking_ == Tracking::kLost) frame = {time, epoch_, std::nullopt, 0, 0};
  if (tracking_ == Tracking::kWrong) {
    const Vector3d off = Vector3d(0.08, -0.05, 0.03) / world_from_map_.scale();
    frame.map_from_cam = {
        frame.map_from_cam->rotation() * rotation_from_vector(Vector3d(0, 4 * kDegree, 0)),
        frame.map_from_cam->translation() + off};
  }
  listener->on_frame(frame);
  if (tracking_ == Tracking::kGood) maybe_make_keyframe(time, listener);
}

void SimulatedRobot::run(double seconds_long, RobotListener* listener) {
  const Time end = now_ + seconds(seconds_long);
  while (now_ < end) {
    if (!arm_is_still_) arm_clock_s_ += kTick.seconds();
    arm_clock_.emplace_back(now_, arm_clock_s_);
    // A reading of now carries a later or earlier stamp than the images' clock would give it.
    listener->on_joints(now_ + seconds(options_.joint_delay_s), joints(arm_clock_s_));
    while (next_frame_ + kFrameLatency <= now_) {
      see_frame(next_frame_, listener);
      next_frame_ = next_frame_ + kFramePeriod;
    }
    now_ = now_ + kTick;
    if ((now_ - kStart).us % 1'000'000 == 0) listener->on_second();
  }
}

void CoreListener::on_joints(Time time, const JointVector& position_rad) {
  core_->add_joints(time, position_rad);
}

void CoreListener::on_frame(const calibration::CameraFrame& frame) {
  static_cast<void>(core_->add_frame(frame));
  for (const auto& b : core_->take_base()) base_.push_back(b);
}

void CoreListener::on_map(int64_t epoch, bool is_first, const MapDelta& delta) {
  core_->apply_map(
      epoch, is_first ? calibration::MapChange::kSnapshot : calibration::MapChange::kDelta, delta);
}

void CoreListener::on_second() {
  for (const auto& b : core_->take_base()) base_.push_back(b);
  if (auto task = core_->take_task()) {
    core_->apply(*task, calibration::solve_alignment(task->problem));
  }
}

AlignmentError alignment_error(const SimulatedRobot& robot,
                               const calibration::AlignmentStatus& alignment) {
  AlignmentError error;
  const Similarity<World, Map>&is = alignment.world_from_map, &should = robot.world_from_map();
  error.scale = std::abs(is.scale() / should.scale() - 1);
  error.rotation_deg = calibration::angle_between(is.rotation(), should.rotation()) / kDegree;
  for (int i = 0; i < 100; ++i) {
    const Time time = robot.now() - milliseconds(100 * (i + 1));
    if (robot.seconds_of(time) < 0) break;
    const Vector3d place = robot.world_from_cam(time).translation();
    const Vector3d estimate = is * (should.inverse() * place);
    error.position_m = std::max(error.position_m, (estimate - place).norm());
  }
  return error;
}

BaseError base_error(const SimulatedRobot& robot, const std::vector<BaseState>& estimates) {
  std::vector<double> mm, deg;
  for (const BaseState& e : estimates) {
    const auto error = robot.world_from_base(e.time).inverse() * e.world_from_base;
    mm.push_back(1e3 * error.translation().norm());
    deg.push_back(calibration::angle_between(error.rotation(), {1, 0, 0, 0}) / kDegree);
  }
  if (mm.empty()) return {1e9, 1e9, 1e9, 1e9};
  std::sort(mm.begin(), mm.end());
  std::sort(deg.begin(), deg.end());
  return {mm[mm.size() / 2], mm.back(), deg[deg.size() / 2], deg.back()};
}

}  // namespace foresight
