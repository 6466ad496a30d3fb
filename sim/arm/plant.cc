#include "sim/arm/plant.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/check.h"

namespace foresight::sim {
namespace {

constexpr int64_t kSubstep_us = 500;

}  // namespace

ArmPlant::ArmPlant(const ArmModel& arm, const PlantParams& params)
    : dynamics_(arm),
      params_(params),
      torque_limit_nm_(arm.size()),
      braking_nm_s_(params.braking_nm_s * arm.motor_from_joint.transpose() * arm.motor_from_joint),
      state_{arm.home(), JointVector::Zero(arm.size())} {
  for (int i = 0; i < arm.size(); ++i) {
    torque_limit_nm_[i] = arm.joints[static_cast<size_t>(i)].torque_limit_nm;
  }
  const JointMatrix motor_from_joint_torque = arm.motor_from_joint.transpose().inverse();
  motor_limit_nm_ =
      params.motor_limit_share * (motor_from_joint_torque.cwiseAbs() * torque_limit_nm_);
}

void ArmPlant::step(Duration duration, const JointVector& motor_torque_nm, MotorMode mode,
                    const BaseMotion& base) {
  FORESIGHT_CHECK(motor_torque_nm.size() == dynamics_.size());
  if (mode == MotorMode::kHeld) {
    state_.velocity_rad_per_s.setZero();
    return;
  }
  JointVector joint_torque_nm = JointVector::Zero(dynamics_.size());
  if (mode == MotorMode::kDriven) {
    const JointVector given_nm =
        motor_torque_nm.cwiseMin(motor_limit_nm_).cwiseMax(-motor_limit_nm_);
    joint_torque_nm = dynamics_.arm().motor_from_joint.transpose() * given_nm;
  }
  const int64_t count = std::max<int64_t>(1, (duration.us + kSubstep_us - 1) / kSubstep_us);
  const double dt_s = duration.seconds() / static_cast<double>(count);
  for (int64_t i = 0; i < count; ++i) substep(dt_s, joint_torque_nm, mode, base);
}

// M (v' − v) / dt = torque − bias(v) + push − drag · v', solved for v'.
void ArmPlant::substep(double dt_s, const JointVector& joint_torque_nm, MotorMode mode,
                       const BaseMotion& base) {
  JointVector& q = state_.position_rad;
  JointVector& v = state_.velocity_rad_per_s;
  q += 0.5 * dt_s * v;
  const PlacedArm placed = dynamics_.place(q);
  const int n = dynamics_.size();
  Forces forces{joint_torque_nm, JointMatrix::Zero(n, n)};
  add_friction(forces);
  add_stops(dt_s, forces);
  if (mode == MotorMode::kBraking) forces.drag_nm_s += braking_nm_s_;
  const JointVector bias_nm = dynamics_.inverse(placed, v, JointVector::Zero(n), base);
  const JointMatrix inertia = dynamics_.mass_matrix(placed) + dt_s * forces.drag_nm_s;
  const JointVector push_nm = forces.push_nm - bias_nm - forces.drag_nm_s * v;
  v += dt_s * inertia.llt().solve(push_nm);
  q += 0.5 * dt_s * v;
}

// Coulomb friction by its secant: at any step length it can only slow a joint, not turn it round.
void ArmPlant::add_friction(Forces& forces) const {
  const double width = params_.coulomb_width_rad_per_s;
  for (int i = 0; i < dynamics_.size(); ++i) {
    const double speed = std::abs(state_.velocity_rad_per_s[i]);
    const double slope = speed < 1e-3 * width ? 1 / width : std::tanh(speed / width) / speed;
    forces.drag_nm_s(i, i) +=
        torque_limit_nm_[i] * (params_.viscous_share_s + params_.coulomb_share * slope);
  }
}

// A spring that pushes back into the range, and a damper that acts on the way into the stop only.
void ArmPlant::add_stops(double dt_s, Forces& forces) const {
  for (int i = 0; i < dynamics_.size(); ++i) {
    const ArmJoint& joint = dynamics_.arm().joints[static_cast<size_t>(i)];
    const double q = state_.position_rad[i];
    const double depth = std::max(q - joint.upper_rad, 0.0) + std::min(q - joint.lower_rad, 0.0);
    if (depth == 0) continue;
    const double stiffness = params_.stop_stiffness_per_rad * torque_limit_nm_[i];
    const bool going_in = depth * state_.velocity_rad_per_s[i] > 0;
    forces.push_nm[i] -= stiffness * depth;
    forces.drag_nm_s(i, i) += stiffness * (dt_s + (going_in ? params_.stop_damping_s : 0));
  }
}

void ArmPlant::read_encoders(std::span<int32_t> counts) const {
  const ArmModel& arm = dynamics_.arm();
  FORESIGHT_CHECK(static_cast<int>(counts.size()) == arm.size());
  const JointVector turns = arm.motor_from_joint * state_.position_rad / (2 * std::numbers::pi);
  for (int i = 0; i < arm.size(); ++i) {
    counts[i] = static_cast<int32_t>(std::lround(turns[i] * arm.counts_per_revolution));
  }
}

}  // namespace foresight::sim
