// Between the arm's motors and its joints: cables and differentials as in the arm file.
//
//   motor angle = motor_from_joint · joint angle      joint torque = motor_from_jointᵀ · motor
//   torque
//
// No allocation, no exceptions.
#pragma once

#include <cstdint>
#include <span>

#include "common/arm_model.h"

namespace foresight {

class Transmission {
 public:
  explicit Transmission(const ArmModel& arm);

  /// `motor_counts` has one entry per motor, 0 at the joints' zero.
  JointVector joint_position_rad(std::span<const int32_t> motor_counts) const;
  /// Not rounded.
  JointVector motor_counts(const JointVector& joint_position_rad) const;
  JointVector motor_torque_nm(const JointVector& joint_torque_nm) const;
  int size() const { return static_cast<int>(joint_from_motor_.rows()); }

 private:
  JointMatrix motor_from_joint_, joint_from_motor_;
  double rad_per_count_;
};

}  // namespace foresight
