// Rigid-body dynamics of an arm from its description file: links with mass and inertia, rotors
// reflected through the transmission, gravity in any direction, a base that moves.
//
//   const ArmDynamics dynamics(arm);
//   const PlacedArm placed = dynamics.place(position_rad);
//   JointVector torque_nm = dynamics.inverse(placed, velocity, acceleration, base);
//   JointVector acceleration = dynamics.forward(placed, velocity, torque_nm, base);
//
// Spatial vectors (angular part first) in base coordinates about the base's origin, after
// Featherstone, Rigid Body Dynamics Algorithms (2008), chapters 2, 5, 6. Torques are those at the
// joints. A rotor counts as inertia along its own motion only: its gyroscopic effect is left out.
// O(n) for inverse(), O(n²) for mass_matrix(), O(n³) for forward(). No allocation.
#pragma once

#include <Eigen/Core>
#include <array>

#include "common/arm_model.h"

namespace foresight::sim {

using SpatialVector = Eigen::Matrix<double, 6, 1>;
using SpatialMatrix = Eigen::Matrix<double, 6, 6>;

constexpr double kGravity_m_per_s2 = 9.81;

/// How the base moves at an instant, in coordinates of the base at that instant.
struct BaseMotion {
  Eigen::Vector3d gravity_m_per_s2{0, 0, -kGravity_m_per_s2};
  Eigen::Vector3d angular_velocity_rad_per_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_m_per_s = Eigen::Vector3d::Zero();  // of the base's origin
  Eigen::Vector3d angular_acceleration_rad_per_s2 = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration_m_per_s2 = Eigen::Vector3d::Zero();  // of the base's origin
};

/// An arm in one position: what depends on the joint angles, in base coordinates.
struct PlacedArm {
  int size = 0;
  std::array<Eigen::Isometry3d, kMaxJoints> base_from_link;
  std::array<SpatialVector, kMaxJoints> axes;      // motion per unit of joint velocity
  std::array<SpatialMatrix, kMaxJoints> inertias;  // of each link
};

class ArmDynamics {
 public:
  explicit ArmDynamics(const ArmModel& arm);

  int size() const { return arm_.size(); }
  const ArmModel& arm() const { return arm_; }
  PlacedArm place(const JointVector& position_rad) const;

  /// Joint torques that this motion needs (recursive Newton–Euler).
  JointVector inverse(const PlacedArm& placed, const JointVector& velocity_rad_per_s,
                      const JointVector& acceleration_rad_per_s2, const BaseMotion& base) const;
  /// Symmetric, positive definite (composite rigid bodies); kg·m².
  JointMatrix mass_matrix(const PlacedArm& placed) const;
  /// Accelerations under joint torques.
  JointVector forward(const PlacedArm& placed, const JointVector& velocity_rad_per_s,
                      const JointVector& torque_nm, const BaseMotion& base) const;

  double kinetic_energy_j(const PlacedArm& placed, const JointVector& velocity_rad_per_s) const;
  /// Zero where every link's centre of mass is at the height of the base's origin.
  double potential_energy_j(const PlacedArm& placed, const Eigen::Vector3d& gravity_m_per_s2) const;
  /// Velocity, relative to the base, of a point fixed to the link `link` (−1: the base); m/s.
  Eigen::Vector3d point_velocity(const PlacedArm& placed, const JointVector& velocity_rad_per_s,
                                 int link, const Eigen::Vector3d& point_in_base) const;

 private:
  ArmModel arm_;
  JointMatrix rotor_inertia_kg_m2_;  // of all rotors, at the joints
};

}  // namespace foresight::sim
