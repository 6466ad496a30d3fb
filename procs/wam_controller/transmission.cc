#include "procs/wam_controller/transmission.h"

#include <Eigen/LU>
#include <numbers>

#include "common/check.h"

namespace foresight {

Transmission::Transmission(const ArmModel& arm)
    : motor_from_joint_(arm.motor_from_joint),
      joint_from_motor_(arm.motor_from_joint.inverse()),
      rad_per_count_(2 * std::numbers::pi / arm.counts_per_revolution) {}

JointVector Transmission::joint_position_rad(std::span<const int32_t> motor_counts) const {
  FORESIGHT_CHECK(static_cast<int>(motor_counts.size()) == size());
  JointVector motor_rad(size());
  for (int i = 0; i < size(); ++i) {
    motor_rad[i] = rad_per_count_ * motor_counts[static_cast<size_t>(i)];
  }
  return joint_from_motor_.lazyProduct(motor_rad);
}

JointVector Transmission::motor_counts(const JointVector& joint_position_rad) const {
  return motor_from_joint_.lazyProduct(joint_position_rad) / rad_per_count_;
}

JointVector Transmission::motor_torque_nm(const JointVector& joint_torque_nm) const {
  return joint_from_motor_.transpose().lazyProduct(joint_torque_nm);
}

}  // namespace foresight
