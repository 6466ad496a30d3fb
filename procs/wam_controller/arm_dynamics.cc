#include "procs/wam_controller/arm_dynamics.h"

#include <array>

namespace foresight {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// One link in its own frame, whose origin lies at the far end of the link.
struct LinkMotion {
  Matrix3d previous_from_link;
  Vector3d way;   // from the previous frame's origin to this one's
  Vector3d axis;  // of the joint before the link
  Vector3d angular_velocity, angular_acceleration, acceleration;  // of the frame
  Vector3d force, moment;  // that accelerate the link, at its centre of mass
};

LinkMotion place(const ArmJoint& joint, double position_rad) {
  const double theta = position_rad + joint.theta_offset_rad;
  const double ct = std::cos(theta), st = std::sin(theta);
  const double ca = std::cos(joint.alpha_rad), sa = std::sin(joint.alpha_rad);
  LinkMotion link;
  link.previous_from_link << ct, -st * ca, st * sa, st, ct * ca, -ct * sa, 0, sa, ca;
  link.way = Vector3d(joint.a_m, joint.d_m * sa, joint.d_m * ca);
  link.axis = Vector3d(0, sa, ca);
  return link;
}

void move(const LinkMotion& previous, double velocity, double acceleration, LinkMotion* link) {
  const auto to_link = link->previous_from_link.transpose();
  const Vector3d carried = to_link * previous.angular_velocity;
  link->angular_velocity = carried + velocity * link->axis;
  link->angular_acceleration = to_link * previous.angular_acceleration + acceleration * link->axis +
                               carried.cross(velocity * link->axis);
  link->acceleration = to_link * previous.acceleration +
                       link->angular_acceleration.cross(link->way) +
                       link->angular_velocity.cross(link->angular_velocity.cross(link->way));
}

void load(const ArmLink& mass, LinkMotion* link) {
  const Vector3d& w = link->angular_velocity;
  const Vector3d& centre = mass.centre_of_mass_m;
  link->force = mass.mass_kg * (link->acceleration + link->angular_acceleration.cross(centre) +
                                w.cross(w.cross(centre)));
  link->moment = mass.inertia_kg_m2 * link->angular_acceleration + w.cross(mass.inertia_kg_m2 * w);
}

}  // namespace

ArmDynamics::ArmDynamics(const ArmModel& arm, const Vector3d& gravity_in_base_m_per_s2)
    : arm_(arm),
      gravity_in_base_(gravity_in_base_m_per_s2),
      rotor_inertia_kg_m2_(arm.motor_from_joint.transpose() * arm.rotor_inertia_kg_m2.asDiagonal() *
                           arm.motor_from_joint) {}

JointVector ArmDynamics::torque_nm(const JointVector& position_rad,
                                   const JointVector& velocity_rad_per_s,
                                   const JointVector& acceleration_rad_per_s2) const {
  std::array<LinkMotion, kMaxJoints> links;
  LinkMotion previous{};
  previous.angular_velocity.setZero();
  previous.angular_acceleration.setZero();
  previous.acceleration = -gravity_in_base_;  // as if the base fell upwards
  const auto count = static_cast<size_t>(arm_.size());
  for (size_t i = 0; i < count; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    links[i] = place(arm_.joints[i], position_rad[row]);
    move(previous, velocity_rad_per_s[row], acceleration_rad_per_s2[row], &links[i]);
    load(arm_.links[i], &links[i]);
    previous = links[i];
  }
  JointVector torque = rotor_inertia_kg_m2_.lazyProduct(acceleration_rad_per_s2);
  Vector3d force = Vector3d::Zero(), moment = Vector3d::Zero();  // handed on by the link beyond
  for (size_t i = count; i-- > 0;) {
    const LinkMotion& link = links[i];
    const Vector3d arm_of_mass = link.way + arm_.links[i].centre_of_mass_m;
    moment += link.way.cross(force) + arm_of_mass.cross(link.force) + link.moment;
    force += link.force;
    torque[static_cast<Eigen::Index>(i)] += moment.dot(link.axis);
    force = link.previous_from_link * force;
    moment = link.previous_from_link * moment;
  }
  return torque;
}

}  // namespace foresight
