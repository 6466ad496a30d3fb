#include "sim/base/base_script.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/random.h"

namespace foresight::sim {
namespace {

using Eigen::AngleAxisd, Eigen::Vector3d;

constexpr double kBlend_s = 2;        // over which swings set in
constexpr double kRampBlend_s = 0.5;  // over which a ramp reaches its velocity

// From 0 to 1 over u in 0…1, with zero velocity and acceleration at both ends.
double smooth_step(double u) {
  u = std::clamp(u, 0.0, 1.0);
  return u * u * u * (10 + u * (-15 + 6 * u));
}

// Integral of smooth_step from 0 to u ≤ 1, and of 1 beyond.
double smooth_step_integral(double u) {
  const double v = std::clamp(u, 0.0, 1.0);
  return v * v * v * v * (2.5 + v * (-3 + v)) + std::max(u - 1, 0.0);
}

// Way after time_s at a velocity that rises from 0 to 1, stays, and falls to 0 again, so that it
// is above one half for duration_s.
double ramp(double time_s, double duration_s) {
  const double blend_s = std::min(kRampBlend_s, duration_s);
  return blend_s * (smooth_step_integral(time_s / blend_s) -
                    smooth_step_integral((time_s - duration_s) / blend_s));
}

Vector3d rotation_vector(const Eigen::Quaterniond& q) {
  const AngleAxisd turn(q);
  return turn.angle() * turn.axis();
}

}  // namespace

BaseScript::BaseScript(const Params& params) : params_(params) {
  if (params.kind == Kind::kWaves) prepare_waves();
  if (params.kind == Kind::kRandomWalk) prepare_random_walk();
}

// A ship's deck: heave and roll strongest, each axis at a period of its own.
void BaseScript::prepare_waves() {
  constexpr std::array<double, 3> kShift = {0.4, 0.6, 1.0}, kTurn = {1.0, 0.6, 0.4};
  constexpr std::array<double, 3> kShiftPace = {0.71, 0.83, 1.0}, kTurnPace = {0.91, 1.13, 0.59};
  const double rate_rad_per_s = 2 * std::numbers::pi / params_.period_s;
  for (size_t i = 0; i < 3; ++i) {
    const auto phase_rad = static_cast<double>(i);
    shift_[i] = {{params_.amplitude_m * kShift[i], rate_rad_per_s * kShiftPace[i], phase_rad}};
    turn_[i] = {{params_.amplitude_rad * kTurn[i], rate_rad_per_s * kTurnPace[i], 2 + phase_rad}};
  }
}

// Swings of many periods, the slower the larger: like a random walk that stays in bounds.
void BaseScript::prepare_random_walk() {
  constexpr int kCount = 6;
  constexpr double kSlowest_s = 40, kRatio = 0.6;  // down to 3 s
  Random random(params_.seed, "base");
  const auto draw = [&](double amplitude) {
    Swings swings;
    double period_s = kSlowest_s, share = 1 - kRatio;
    for (int i = 0; i < kCount; ++i, period_s *= kRatio, share *= kRatio) {
      swings.push_back({amplitude * share,
                        2 * std::numbers::pi / (period_s * random.uniform(0.85, 1.15)),
                        random.uniform(0, 2 * std::numbers::pi)});
    }
    return swings;
  };
  for (size_t i = 0; i < 3; ++i) {
    shift_[i] = draw(params_.amplitude_m * (i == 2 ? 0.2 : 1));  // it stands on the floor
    turn_[i] = draw(params_.amplitude_rad * (i == 2 ? 1 : 0.2));
  }
}

double BaseScript::sum(const Swings& swings, double time_s) {
  double value = 0;
  for (const Swing& s : swings) {
    value += s.amplitude * std::sin(s.rate_rad_per_s * time_s + s.phase_rad);
  }
  return value;
}

Pose<World, Base> BaseScript::displaced(double way_m, double yaw_rad) const {
  const double direction_rad = params_.direction_rad;
  const Vector3d shift(std::cos(direction_rad) * way_m, std::sin(direction_rad) * way_m, 0);
  return {Eigen::Quaterniond(AngleAxisd(yaw_rad, Vector3d::UnitZ())), shift};
}

Pose<World, Base> BaseScript::swinging(double time_s) const {
  const double share = smooth_step(time_s / kBlend_s);
  const auto value = [&](const Swings& swings) { return share * sum(swings, time_s); };
  const Vector3d shift(value(shift_[0]), value(shift_[1]), value(shift_[2]));
  return {Eigen::Quaterniond(AngleAxisd(value(turn_[2]), Vector3d::UnitZ()) *
                             AngleAxisd(value(turn_[1]), Vector3d::UnitY()) *
                             AngleAxisd(value(turn_[0]), Vector3d::UnitX())),
          shift};
}

Pose<World, Base> BaseScript::at(double time_s) const {
  const double since_s = time_s - params_.start_s;
  if (since_s <= 0 || params_.kind == Kind::kStill) return {};
  switch (params_.kind) {
    case Kind::kPush: {
      const double share = smooth_step(since_s / params_.duration_s);
      return displaced(share * params_.amplitude_m, share * params_.amplitude_rad);
    }
    case Kind::kRamp:
      return displaced(params_.speed_m_per_s * ramp(since_s, params_.duration_s), 0);
    default:
      return swinging(since_s);
  }
}

BaseMotion BaseScript::motion_at(double time_s) const {
  if (params_.kind == Kind::kStill) return {};
  constexpr double kStep_s = 1e-3;
  const Pose<World, Base> before = at(time_s - kStep_s), now = at(time_s);
  const Pose<World, Base> after = at(time_s + kStep_s);
  const Eigen::Quaterniond base_from_world = now.rotation().conjugate();
  const Vector3d turn_before = rotation_vector(before.rotation().conjugate() * now.rotation());
  const Vector3d turn_after = rotation_vector(base_from_world * after.rotation());
  const Vector3d shift_before = now.translation() - before.translation();
  const Vector3d shift_after = after.translation() - now.translation();
  BaseMotion motion;
  motion.gravity_m_per_s2 = base_from_world * Vector3d(0, 0, -kGravity_m_per_s2);
  motion.angular_velocity_rad_per_s = (turn_before + turn_after) / (2 * kStep_s);
  motion.velocity_m_per_s = base_from_world * (shift_before + shift_after) / (2 * kStep_s);
  motion.angular_acceleration_rad_per_s2 = (turn_after - turn_before) / (kStep_s * kStep_s);
  motion.acceleration_m_per_s2 =
      base_from_world * (shift_after - shift_before) / (kStep_s * kStep_s);
  return motion;
}

}  // namespace foresight::sim
