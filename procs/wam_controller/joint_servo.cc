#include "procs/wam_controller/joint_servo.h"

#include <algorithm>
#include <numbers>

namespace foresight {
namespace {

constexpr double kLongestStep_s = 0.02;  // a late step must not integrate the time that it missed

}  // namespace

JointServo::JointServo(const ArmModel& arm, double filter_hz)
    : kp_(arm.size()),
      ki_(arm.size()),
      kd_(arm.size()),
      limit_nm_(arm.size()),
      filter_s_(1 / (2 * std::numbers::pi * filter_hz)) {
  for (int i = 0; i < arm.size(); ++i) {
    const ArmJoint& joint = arm.joints[static_cast<size_t>(i)];
    kp_[i] = joint.kp;
    ki_[i] = joint.ki;
    kd_[i] = joint.kd;
    limit_nm_[i] = joint.torque_limit_nm;
  }
  reset(JointVector::Zero(arm.size()));
}

void JointServo::reset(const JointVector& position_rad) {
  position_rad_ = position_rad;
  velocity_rad_per_s_ = JointVector::Zero(position_rad.size());
  integral_nm_ = JointVector::Zero(position_rad.size());
}

void JointServo::measure(const JointVector& position_rad, double dt_s) {
  const double share = dt_s / (dt_s + filter_s_);
  velocity_rad_per_s_ += share * ((position_rad - position_rad_) / dt_s - velocity_rad_per_s_);
  position_rad_ = position_rad;
}

JointVector JointServo::torque_nm(const JointMotion& reference, const JointVector& feed_forward_nm,
                                  double dt_s) {
  const double step_s = std::min(dt_s, kLongestStep_s);
  JointVector torque(position_rad_.size());
  for (Eigen::Index i = 0; i < torque.size(); ++i) {
    const double limit = limit_nm_[i];
    const double error = reference.position_rad[i] - position_rad_[i];
    const double rate = reference.velocity_rad_per_s[i] - velocity_rad_per_s_[i];
    const double others = feed_forward_nm[i] + kp_[i] * error + kd_[i] * rate;
    const bool pushes_out =
        std::abs(others + integral_nm_[i]) >= limit && error * (others + integral_nm_[i]) > 0;
    if (!pushes_out) {
      integral_nm_[i] = std::clamp(integral_nm_[i] + ki_[i] * error * step_s, -limit, limit);
    }
    torque[i] = std::clamp(others + integral_nm_[i], -limit, limit);
  }
  return torque;
}

}  // namespace foresight
