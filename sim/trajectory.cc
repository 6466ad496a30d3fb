#include "sim/trajectory.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/random.h"

namespace foresight::sim {
namespace {

using Eigen::Vector3d;

constexpr double kEaseIn_s = 1.5;       // from rest to full pace
constexpr double kCheckedSpan_s = 120;  // over which the limits are checked
constexpr double kMargin = 0.95;
constexpr double kReturnPeriod_s = 14;  // at full pace
constexpr double kLapPeriod_s = 12;     // at full pace, which is always too fast
constexpr double kLapRate_rad_per_s = 2 * std::numbers::pi / kLapPeriod_s;

// Camera at a point that looks at another, turned about its axis out of the level.
Pose<World, Cam> looking(const Vector3d& from, const Vector3d& at, double roll_rad = 0) {
  const Vector3d forward = (at - from).normalized();
  const Vector3d right = forward.cross(Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d rotation;
  rotation << right, forward.cross(right), forward;
  rotation *= Eigen::AngleAxisd(roll_rad, Vector3d::UnitZ()).toRotationMatrix();
  return {rotation, from};
}

}  // namespace

double Trajectory::Swing::at(double t_s) const {
  return amplitude * (std::sin(rate_rad_per_s * t_s + phase_rad) - std::sin(phase_rad));
}

Trajectory::Ring Trajectory::ring_of(uint64_t seed) {
  constexpr double kDegree = std::numbers::pi / 180;
  Random random(seed, "ring");
  const auto vary = [&random](double low, double high) { return random.uniform(low, high); };
  const auto swing = [&](double amplitude, int per_lap) {
    return Swing{amplitude, per_lap * kLapRate_rad_per_s, vary(0, 6)};
  };
  Ring ring;
  ring.direction = random.below(2) == 0 ? -1 : 1;
  ring.radius_m = vary(0.84, 0.96);
  ring.height_m = vary(0.37, 0.45);
  ring.down_rad = vary(11, 14) * kDegree;
  ring.start_rad = vary(-0.5, 0.5);
  ring.radius = swing(0.02, 2);
  ring.height = swing(0.03, 3);
  ring.down = swing(1.5 * kDegree, 2);
  return ring;
}

Trajectory::Trajectory(Kind kind, uint64_t seed) : kind_(kind), ring_(ring_of(seed)) {
  Random random(seed, "trajectory");
  const auto vary = [&random](double low, double high) { return random.uniform(low, high); };
  const double side = random.below(2) == 0 ? -1 : 1;
  start_in_world_ = {vary(0.15, 0.25), -0.08 * side, vary(0.36, 0.46)};
  target_in_world_ = {1.45, -0.10 * side, vary(-0.06, 0.02)};
  if (kind == Kind::kRotation) {
    target_ = {Swing{}, {side * 0.95, vary(0.5, 0.6), 0}, {0.22, vary(0.7, 0.9), 0}};
  } else if (kind == Kind::kDesk || kind == Kind::kReturn) {
    // The target follows the camera at half the width: the scene is seen under changing angles.
    const double rate = vary(0.55, 0.65);
    position_ = {Swing{0.10, vary(0.35, 0.45), 0.5}, {side * 0.42, rate, 0}, {0.10, 0.7 * rate, 0}};
    position_detail_ = {Swing{0.03, vary(0.9, 1.3), vary(0, 6)},
                        {0.04, vary(1.0, 1.4), vary(0, 6)},
                        {0.03, vary(0.9, 1.3), vary(0, 6)}};
    target_ = {Swing{0.1, 0.3, 0}, {side * 0.35, 0.8 * rate, 0}, {0.10, 0.55 * rate, 0}};
  }
  if (kind == Kind::kWander) wander(seed);
  pace_ = std::min(1.0, kMargin * safe_pace());
}

// Two swings per axis whose periods have nothing in common: six axes that meet every combination.
void Trajectory::wander(uint64_t seed) {
  constexpr double kDegree = std::numbers::pi / 180;
  Random random(seed, "wander");
  const auto swing = [&random](double amplitude, double period_s) {
    const double rate = 2 * std::numbers::pi / (period_s * random.uniform(0.95, 1.05));
    return Swing{amplitude, rate, random.uniform(0, 6)};
  };
  position_ = {swing(0.11, 7.9), swing(0.17, 9.1), swing(0.10, 8.3)};
  position_detail_ = {swing(0.07, 5.7), swing(0.11, 6.3), swing(0.06, 10.3)};
  target_ = {Swing{}, swing(0.35, 6.1), swing(0.18, 7.3)};
  target_detail_ = {Swing{}, swing(0.22, 9.7), swing(0.12, 5.2)};
  roll_ = {swing(7 * kDegree, 8.9), swing(5 * kDegree, 6.7)};
}

// The greatest pace at which neither limit is passed.
double Trajectory::safe_pace() const {
  constexpr double kStep_s = 0.01;
  double speed = 1e-9, turn = 1e-9;
  Pose<World, Cam> last = pose_at_phase(0);
  for (double t = kStep_s; t < kCheckedSpan_s; t += kStep_s) {
    const Pose<World, Cam> now = pose_at_phase(t);
    speed = std::max(speed, (now.translation() - last.translation()).norm() / kStep_s);
    turn = std::max(turn, now.rotation().angularDistance(last.rotation()) / kStep_s);
    last = now;
  }
  return std::min(kMaxSpeed_m_per_s / speed, kMaxTurn_rad_per_s / turn);
}

Pose<World, Cam> Trajectory::pose_on_ring(double phase_s) const {
  const double around = ring_.start_rad + ring_.direction * kLapRate_rad_per_s * phase_s;
  const double down = ring_.down_rad + ring_.down.at(phase_s);
  const Vector3d outward(std::cos(around), std::sin(around), 0);
  const Vector3d from = (ring_.radius_m + ring_.radius.at(phase_s)) * outward +
                        (ring_.height_m + ring_.height.at(phase_s)) * Vector3d::UnitZ();
  return looking(from, from + std::cos(down) * outward - std::sin(down) * Vector3d::UnitZ());
}

Pose<World, Cam> Trajectory::pose_at_phase(double phase_s) const {
  if (kind_ == Kind::kLoop) return pose_on_ring(phase_s);
  double t = phase_s;
  if (kind_ == Kind::kReturn) {
    // Out along the path and back along it, at the full speed in between.
    constexpr double kRate_rad_per_s = 2 * std::numbers::pi / kReturnPeriod_s;
    t = (1 - std::cos(kRate_rad_per_s * phase_s)) / kRate_rad_per_s;
  }
  Vector3d from = start_in_world_, target = target_in_world_;
  for (int axis = 0; axis < 3; ++axis) {
    from[axis] += position_[axis].at(t) + position_detail_[axis].at(t);
    target[axis] += target_[axis].at(t) + target_detail_[axis].at(t);
  }
  return looking(from, target, roll_[0].at(t) + roll_[1].at(t));
}

double Trajectory::phase_at(double t_s) const {
  if (t_s <= 0) return 0;
  if (t_s >= kEaseIn_s) return pace_ * (t_s - kEaseIn_s / 2);
  // Integral of the smooth step 3u² − 2u³.
  const double u = t_s / kEaseIn_s;
  return pace_ * kEaseIn_s * (u * u * u - 0.5 * u * u * u * u);
}

Pose<World, Cam> Trajectory::at(Duration since_start) const {
  return pose_at_phase(phase_at(since_start.seconds()));
}

Duration Trajectory::time_of_return(int count) const {
  return seconds(kReturnPeriod_s * count / pace_ + kEaseIn_s / 2);
}

Duration Trajectory::time_of_lap(int count) const {
  return seconds(kLapPeriod_s * count / pace_ + kEaseIn_s / 2);
}

}  // namespace foresight::sim
