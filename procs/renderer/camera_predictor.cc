#include "procs/renderer/camera_predictor.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace foresight {
namespace {

constexpr Duration kAccelerationLasts = milliseconds(350);
constexpr size_t kDelaysKept = 31;
// Long enough to see an acceleration through the noise, short beside the motions of a base.
constexpr Duration kAccelerationWindow = milliseconds(250);
constexpr size_t kCommandsKept = 600;  // 20 s at 30 Hz

}  // namespace

CameraPredictor::CameraPredictor(const ArmModel& arm, const CameraPredictorOptions& options)
    : arm_(arm), options_(options) {}

bool CameraPredictor::add_command(const CommandedJoints& command) {
  if (command.position_rad.size() != arm_.size()) return false;
  if (!commands_.empty()) {
    if (command.session < commands_.back().session) return false;
    if (command.session > commands_.back().session) commands_.clear();
  }
  if (!commands_.empty() && command.time <= commands_.back().time) return false;
  commands_.push_back(command);
  if (commands_.size() > kCommandsKept) commands_.pop_front();
  return true;
}

bool CameraPredictor::set_joint_state(const MeasuredJoints& state) {
  if (state.position_rad.size() != arm_.size() || state.reference_rad.size() != arm_.size() ||
      state.target_rad.size() != arm_.size() ||
      state.reference_velocity_rad_per_s.size() != arm_.size()) {
    return false;
  }
  if (state_ && state.time <= state_->time && state_->time - state.time < seconds(1)) return false;
  const bool new_command =
      state.command_time.us != 0 && (!state_ || state.command_time != state_->command_time);
  if (new_command) {
    delays_.push_back(state.command_arrival - state.command_time);
    if (delays_.size() > kDelaysKept) delays_.pop_front();
  }
  state_ = state;
  // The newest command stays: whoever shows commanded joints needs it.
  while (commands_.size() > 1 && commands_.front().time <= state.command_time) {
    commands_.pop_front();
  }
  return true;
}

Duration CameraPredictor::command_delay() const {
  if (delays_.empty()) return {};
  std::vector<Duration> sorted(delays_.begin(), delays_.end());
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<int64_t>(sorted.size() / 2),
                   sorted.end());
  return std::max(Duration{}, sorted[sorted.size() / 2]);
}

bool CameraPredictor::set_base(const BaseMotion& base) {
  const bool continues = base_ && base_->epoch == base.epoch;
  if (continues && base.time <= base_->time && base_->time - base.time < seconds(1)) return false;
  if (!continues || base.time < base_->time) recent_bases_.clear();
  base_ = base;
  recent_bases_.push_back(base);
  while (base.time - recent_bases_.front().time > kAccelerationWindow) recent_bases_.pop_front();
  find_base_acceleration();
  return true;
}

// The slope of the last velocities (least squares).
void CameraPredictor::find_base_acceleration() {
  base_acceleration_m_per_s2_.setZero();
  base_angular_acceleration_rad_per_s2_.setZero();
  const Time newest = recent_bases_.back().time;
  if (newest - recent_bases_.front().time < milliseconds(190)) return;
  double mean_s = 0;
  for (const BaseMotion& b : recent_bases_) mean_s += (b.time - newest).seconds();
  mean_s /= static_cast<double>(recent_bases_.size());
  double spread_s2 = 0;
  for (const BaseMotion& b : recent_bases_) {
    const double t = (b.time - newest).seconds() - mean_s;
    spread_s2 += t * t;
    base_acceleration_m_per_s2_ += t * b.velocity_m_per_s;
    base_angular_acceleration_rad_per_s2_ += t * b.angular_velocity_rad_per_s;
  }
  base_acceleration_m_per_s2_ /= spread_s2;
  base_angular_acceleration_rad_per_s2_ /= spread_s2;
}

std::optional<PredictedCamera> CameraPredictor::predict(Time now) {
  reason_.clear();
  if (!state_) reason_ = "no JOINT_STATE yet";
  if (state_ && !alignment_) reason_ = "map and robot are not aligned yet";
  if (state_ && alignment_ && (!base_ || base_->epoch != alignment_->epoch)) {
    reason_ = "no BASE_POSE yet";
  }
  if (!reason_.empty()) return std::nullopt;
  PredictedCamera predicted;
  predicted.instant = now + command_delay();
  predicted.command_time = commands_.empty() ? Time{} : commands_.back().time;
  predicted.epoch = alignment_->epoch;
  predicted.position_rad = predict_joints(predicted.instant);
  predicted.world_from_base = predict_base(predicted.instant);
  predicted.world_from_cam = predicted.world_from_base * arm_.base_from_ee(predicted.position_rad) *
                             alignment_->ee_from_cam;
  predicted.map_from_cam = alignment_->world_from_map.inverse() * predicted.world_from_cam;
  return predicted;
}

JointVector CameraPredictor::predict_joints(Time instant) const {
  if (!powered_) return state_->position_rad;
  const bool follows =
      options_.joints == PredictedJoints::kRobot || commands_.empty() || !commands_.back().engaged;
  if (follows) return run_reference(instant);
  return arm_.clamp(commands_.back().position_rad, options_.joint_margin_rad);
}

// The controller's reference, carried on from the newest state. A fitted profile re-fitted from its
// middle is the same profile, so going on to the state's target changes nothing.
JointVector CameraPredictor::run_reference(Time instant) const {
  const MeasuredJoints& s = *state_;
  JointReference reference(options_.limits);
  reference.begin(s.time, s.reference_rad, s.reference_velocity_rad_per_s);
  reference.follow(s.time, s.target_rad);
  const Duration delay = command_delay();
  Time last_arrival = s.command_arrival;
  bool moves = last_arrival.us != 0;
  for (const CommandedJoints& command : commands_) {
    if (command.time <= s.command_time) continue;
    const Time arrival = std::max(command.time + delay, s.time);
    if (arrival > instant) break;
    if (moves && arrival - last_arrival > options_.command_timeout) {
      reference.stop(std::max(s.time, last_arrival + options_.command_timeout));
    }
    if (command.engaged) {
      reference.follow(arrival, arm_.clamp(command.position_rad, options_.joint_margin_rad));
    } else {
      reference.stop(arrival);
    }
    moves = command.engaged;
    last_arrival = arrival;
  }
  const Time end = std::max(s.time, last_arrival + options_.command_timeout);
  if (moves && instant > end) reference.stop(end);
  // What the arm lags behind its reference (friction, mostly) it will lag then.
  return reference.at(std::max(instant, s.time)).position_rad + s.position_rad - s.reference_rad;
}

Pose<World, Base> CameraPredictor::predict_base(Time instant) const {
  const Duration ahead =
      std::clamp(instant - base_->time, Duration{}, options_.longest_extrapolation);
  const double t_s = ahead.seconds();
  // Accelerations do not last: they are carried on for a while only.
  const double bent_s2 = std::pow(std::min(t_s, kAccelerationLasts.seconds()), 2) / 2;
  const Eigen::Vector3d turn =
      base_->angular_velocity_rad_per_s * t_s + base_angular_acceleration_rad_per_s2_ * bent_s2;
  const double angle = turn.norm();
  const Eigen::AngleAxisd rotation(
      angle, angle > 1e-12 ? Eigen::Vector3d(turn / angle) : Eigen::Vector3d::UnitX());
  return {Eigen::Quaterniond(rotation) * base_->world_from_base.rotation(),
          base_->world_from_base.translation() + base_->velocity_m_per_s * t_s +
              base_acceleration_m_per_s2_ * bent_s2};
}

}  // namespace foresight
