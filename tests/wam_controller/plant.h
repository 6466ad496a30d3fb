// A stand-in for the arm: rigid links moved by joint torques. Its equations come from energies
// (mass matrix from Jacobians, Coriolis terms from its derivatives), so that they also check the
// controller's recursive ones.
#pragma once

#include "common/arm_model.h"

namespace foresight {

class Plant {
 public:
  explicit Plant(const ArmModel& arm);

  /// Rotors included.
  JointMatrix mass_matrix(const JointVector& position_rad) const;
  JointVector gravity_nm(const JointVector& position_rad,
                         const Eigen::Vector3d& gravity_m_per_s2) const;
  double potential_energy_j(const JointVector& position_rad,
                            const Eigen::Vector3d& gravity_m_per_s2) const;
  /// Coriolis and centrifugal torques.
  JointVector coriolis_nm(const JointVector& position_rad, const JointVector& velocity) const;

  void move(const JointVector& torque_nm, double duration_s);
  void brake() { velocity.setZero(); }

  JointVector position, velocity;  // rad, rad/s

 private:
  ArmModel arm_;
};

}  // namespace foresight
