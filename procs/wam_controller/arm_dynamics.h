// The torques that a motion of the arm takes: recursive Newton–Euler over the links of the arm
// file, plus the rotors' inertia as seen through the transmission.
//
//   ArmDynamics dynamics(arm, Eigen::Vector3d(0, 0, -9.81));
//   JointVector gravity_nm = dynamics.torque_nm(q, zero, zero);
//
// Per link, outwards: velocities and accelerations of its frame and centre of mass; inwards: the
// force and moment that it takes (Luh, Walker, Paul 1980, in frames by the standard
// Denavit–Hartenberg convention). No friction. O(joints); no allocation, no exceptions.
#pragma once

#include "common/arm_model.h"

namespace foresight {

class ArmDynamics {
 public:
  /// `gravity_in_base_m_per_s2`: (0, 0, −9.81) for an upright base.
  ArmDynamics(const ArmModel& arm, const Eigen::Vector3d& gravity_in_base_m_per_s2);

  /// Joint torques for this motion; the vectors have arm.size() rows (rad, rad/s, rad/s²).
  JointVector torque_nm(const JointVector& position_rad, const JointVector& velocity_rad_per_s,
                        const JointVector& acceleration_rad_per_s2) const;

 private:
  ArmModel arm_;
  Eigen::Vector3d gravity_in_base_;
  JointMatrix rotor_inertia_kg_m2_;  // at the joints
};

}  // namespace foresight
