#include "tests/wam_controller/plant.h"

#include <Eigen/Cholesky>

namespace foresight {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Jacobian = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMaxJoints>;

struct LinkJacobian {
  Jacobian linear, angular;  // of the centre of mass
  Matrix3d base_from_link;
  Vector3d centre;
};

LinkJacobian jacobian_of(const ArmModel& arm, const JointVector& q, int link) {
  LinkJacobian j{Jacobian::Zero(3, arm.size()), Jacobian::Zero(3, arm.size()), {}, {}};
  const Eigen::Isometry3d base_from_link = arm.base_from_link(q, link);
  j.base_from_link = base_from_link.linear();
  j.centre = base_from_link * arm.links[static_cast<size_t>(link)].centre_of_mass_m;
  for (int i = 0; i <= link; ++i) {
    Eigen::Isometry3d before = Eigen::Isometry3d::Identity();
    if (i > 0) before = arm.base_from_link(q, i - 1);
    const Vector3d axis = before.linear().col(2);
    j.angular.col(i) = axis;
    j.linear.col(i) = axis.cross(j.centre - before.translation());
  }
  return j;
}

}  // namespace

Plant::Plant(const ArmModel& arm)
    : position(arm.home()), velocity(JointVector::Zero(arm.size())), arm_(arm) {}

JointMatrix Plant::mass_matrix(const JointVector& q) const {
  JointMatrix mass = arm_.motor_from_joint.transpose() * arm_.rotor_inertia_kg_m2.asDiagonal() *
                     arm_.motor_from_joint;
  for (int link = 0; link < arm_.size(); ++link) {
    const ArmLink& body = arm_.links[static_cast<size_t>(link)];
    const LinkJacobian j = jacobian_of(arm_, q, link);
    const Matrix3d inertia = j.base_from_link * body.inertia_kg_m2 * j.base_from_link.transpose();
    mass += body.mass_kg * j.linear.transpose() * j.linear +
            j.angular.transpose() * inertia * j.angular;
  }
  return mass;
}

JointVector Plant::gravity_nm(const JointVector& q, const Vector3d& gravity) const {
  JointVector torque = JointVector::Zero(arm_.size());
  for (int link = 0; link < arm_.size(); ++link) {
    const double mass_kg = arm_.links[static_cast<size_t>(link)].mass_kg;
    torque -= mass_kg * jacobian_of(arm_, q, link).linear.transpose() * gravity;
  }
  return torque;
}

double Plant::potential_energy_j(const JointVector& q, const Vector3d& gravity) const {
  double energy = 0;
  for (int link = 0; link < arm_.size(); ++link) {
    energy -= arm_.links[static_cast<size_t>(link)].mass_kg *
              gravity.dot(jacobian_of(arm_, q, link).centre);
  }
  return energy;
}

// d/dt(M v) − ½ ∂(vᵀ M v)/∂q at constant v, by differences.
JointVector Plant::coriolis_nm(const JointVector& q, const JointVector& v) const {
  constexpr double kStep = 1e-5;
  JointVector torque = (mass_matrix(q + kStep * v) - mass_matrix(q - kStep * v)) * v / (2 * kStep);
  for (int i = 0; i < arm_.size(); ++i) {
    JointVector shift = JointVector::Zero(arm_.size());
    shift[i] = kStep;
    const JointMatrix change = (mass_matrix(q + shift) - mass_matrix(q - shift)) / (2 * kStep);
    torque[i] -= 0.5 * v.dot(change * v);
  }
  return torque;
}

void Plant::move(const JointVector& torque_nm, double duration_s) {
  constexpr int kSteps = 4;
  const double step_s = duration_s / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    const JointVector free =
        torque_nm - gravity_nm(position, {0, 0, -9.81}) - coriolis_nm(position, velocity);
    const Eigen::MatrixXd mass = mass_matrix(position);
    velocity += step_s * JointVector(mass.llt().solve(Eigen::VectorXd(free)));
    position += step_s * velocity;
  }
}

}  // namespace foresight
