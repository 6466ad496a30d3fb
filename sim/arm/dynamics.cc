#include "sim/arm/dynamics.h"

#include <Eigen/Cholesky>

#include "common/check.h"

namespace foresight::sim {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;

Matrix3d cross_matrix(const Vector3d& v) {
  Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

// Inertia about the origin of a body with this mass, centre of mass and inertia about that centre.
SpatialMatrix spatial_inertia(double mass_kg, const Vector3d& centre, const Matrix3d& inertia) {
  const Matrix3d c = cross_matrix(centre);
  SpatialMatrix m;
  m.topLeftCorner<3, 3>() = inertia - mass_kg * c * c;
  m.topRightCorner<3, 3>() = mass_kg * c;
  m.bottomLeftCorner<3, 3>() = -mass_kg * c;
  m.bottomRightCorner<3, 3>() = mass_kg * Matrix3d::Identity();
  return m;
}

// v × m for a motion m.
SpatialVector cross_motion(const SpatialVector& v, const SpatialVector& m) {
  const Vector3d angular = v.head<3>(), linear = v.tail<3>();
  SpatialVector result;
  result << angular.cross(m.head<3>()), linear.cross(m.head<3>()) + angular.cross(m.tail<3>());
  return result;
}

// v ×* f for a force f.
SpatialVector cross_force(const SpatialVector& v, const SpatialVector& f) {
  const Vector3d angular = v.head<3>(), linear = v.tail<3>();
  SpatialVector result;
  result << angular.cross(f.head<3>()) + linear.cross(f.tail<3>()), angular.cross(f.tail<3>());
  return result;
}

SpatialVector base_velocity(const BaseMotion& base) {
  SpatialVector v;
  v << base.angular_velocity_rad_per_s, base.velocity_m_per_s;
  return v;
}

// Spatial acceleration of the base; gravity enters as if the base accelerated upwards.
SpatialVector base_acceleration(const BaseMotion& base) {
  SpatialVector a;
  a << base.angular_acceleration_rad_per_s2,
      base.acceleration_m_per_s2 - base.angular_velocity_rad_per_s.cross(base.velocity_m_per_s) -
          base.gravity_m_per_s2;
  return a;
}

}  // namespace

ArmDynamics::ArmDynamics(const ArmModel& arm)
    : arm_(arm),
      rotor_inertia_kg_m2_(arm.motor_from_joint.transpose() * arm.rotor_inertia_kg_m2.asDiagonal() *
                           arm.motor_from_joint) {
  FORESIGHT_CHECK(arm.links.size() == arm.joints.size() && arm.size() <= kMaxJoints);
}

PlacedArm ArmDynamics::place(const JointVector& position_rad) const {
  PlacedArm placed;
  placed.size = size();
  Eigen::Isometry3d base_from_previous = Eigen::Isometry3d::Identity();
  for (int i = 0; i < placed.size; ++i) {
    const ArmLink& link = arm_.links[static_cast<size_t>(i)];
    const ArmJoint& joint = arm_.joints[static_cast<size_t>(i)];
    const Vector3d axis = base_from_previous.linear().col(2);
    placed.axes[i] << axis, base_from_previous.translation().cross(axis);
    base_from_previous.rotate(
        Eigen::AngleAxisd(position_rad[i] + joint.theta_offset_rad, Vector3d::UnitZ()));
    base_from_previous.translate(Vector3d(joint.a_m, 0, joint.d_m));
    base_from_previous.rotate(Eigen::AngleAxisd(joint.alpha_rad, Vector3d::UnitX()));
    placed.base_from_link[i] = base_from_previous;
    const Matrix3d turn = base_from_previous.linear();
    placed.inertias[i] = spatial_inertia(link.mass_kg, base_from_previous * link.centre_of_mass_m,
                                         turn * link.inertia_kg_m2 * turn.transpose());
  }
  return placed;
}

JointVector ArmDynamics::inverse(const PlacedArm& placed, const JointVector& velocity_rad_per_s,
                                 const JointVector& acceleration_rad_per_s2,
                                 const BaseMotion& base) const {
  std::array<SpatialVector, kMaxJoints> forces;
  SpatialVector v = base_velocity(base);
  SpatialVector a = base_acceleration(base);
  for (int i = 0; i < placed.size; ++i) {
    const SpatialVector turn = placed.axes[i] * velocity_rad_per_s[i];
    v += turn;
    a += placed.axes[i] * acceleration_rad_per_s2[i] + cross_motion(v, turn);
    forces[i] = placed.inertias[i] * a + cross_force(v, placed.inertias[i] * v);
  }
  JointVector torque_nm = rotor_inertia_kg_m2_ * acceleration_rad_per_s2;
  SpatialVector force = SpatialVector::Zero();
  for (int i = placed.size - 1; i >= 0; --i) {
    force += forces[i];
    torque_nm[i] += placed.axes[i].dot(force);
  }
  return torque_nm;
}

JointMatrix ArmDynamics::mass_matrix(const PlacedArm& placed) const {
  JointMatrix mass = rotor_inertia_kg_m2_;
  SpatialMatrix composite = SpatialMatrix::Zero();
  for (int i = placed.size - 1; i >= 0; --i) {
    composite += placed.inertias[i];
    const SpatialVector momentum = composite * placed.axes[i];
    for (int j = 0; j <= i; ++j) {
      const double entry = placed.axes[j].dot(momentum);
      mass(i, j) += entry;
      if (j != i) mass(j, i) += entry;
    }
  }
  return mass;
}

JointVector ArmDynamics::forward(const PlacedArm& placed, const JointVector& velocity_rad_per_s,
                                 const JointVector& torque_nm, const BaseMotion& base) const {
  const JointVector bias_nm = inverse(placed, velocity_rad_per_s, JointVector::Zero(size()), base);
  return mass_matrix(placed).llt().solve(torque_nm - bias_nm);
}

double ArmDynamics::kinetic_energy_j(const PlacedArm& placed,
                                     const JointVector& velocity_rad_per_s) const {
  return 0.5 * velocity_rad_per_s.dot(mass_matrix(placed) * velocity_rad_per_s);
}

double ArmDynamics::potential_energy_j(const PlacedArm& placed,
                                       const Vector3d& gravity_m_per_s2) const {
  double energy_j = 0;
  for (int i = 0; i < placed.size; ++i) {
    const ArmLink& link = arm_.links[static_cast<size_t>(i)];
    energy_j -=
        link.mass_kg * gravity_m_per_s2.dot(placed.base_from_link[i] * link.centre_of_mass_m);
  }
  return energy_j;
}

Vector3d ArmDynamics::point_velocity(const PlacedArm& placed, const JointVector& velocity_rad_per_s,
                                     int link, const Vector3d& point_in_base) const {
  SpatialVector v = SpatialVector::Zero();
  for (int i = 0; i <= link; ++i) v += placed.axes[i] * velocity_rad_per_s[i];
  return v.tail<3>() + v.head<3>().cross(point_in_base);
}

}  // namespace foresight::sim
