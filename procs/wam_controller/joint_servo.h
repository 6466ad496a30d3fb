// Holds the joints on their reference: one PID per joint with the gains and torque limits of the
// arm file, and velocity from filtered differences of the encoders.
//
//   servo.reset(position_rad);
//   servo.measure(position_rad, dt_s);
//   torque = servo.torque_nm(reference, feed_forward_nm, dt_s);
//
// The integral stops growing while the torque is at its limit and the error would push it further,
// and its own torque stays within the limit. No allocation, no exceptions.
#pragma once

#include "common/arm_model.h"
#include "common/joint_reference.h"

namespace foresight {

class JointServo {
 public:
  /// `filter_hz`: corner frequency of the velocity's low pass.
  JointServo(const ArmModel& arm, double filter_hz);

  /// At rest here, with an empty integral.
  void reset(const JointVector& position_rad);
  /// Takes an encoder reading `dt_s` > 0 after the last one.
  void measure(const JointVector& position_rad, double dt_s);
  /// Adds PID to the feed-forward, within the limits.
  JointVector torque_nm(const JointMotion& reference, const JointVector& feed_forward_nm,
                        double dt_s);

  const JointVector& position_rad() const { return position_rad_; }
  const JointVector& velocity_rad_per_s() const { return velocity_rad_per_s_; }

 private:
  JointVector kp_, ki_, kd_, limit_nm_;
  double filter_s_;
  JointVector position_rad_, velocity_rad_per_s_, integral_nm_;
};

}  // namespace foresight
