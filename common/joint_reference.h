// The reference that the arm's controller makes its joints follow: one trapezoid per joint,
// re-fitted from its present position and velocity at every command. The controller runs it, and so
// does whoever predicts the robot: the same commands at the same times give the same motion. Which
// commands: those that the controller accepts (procs/wam_controller/README.md, "Who drives"), each
// at its arrival; stop() when the driver lets go, at its arrival, and at the end of his lease, which
// is his last accepted arrival + the command time-out.
//
//   JointReference reference({.velocity = 1, .acceleration = 1});
//   reference.rest(now, measured_rad);
//   reference.follow(now, target_rad);
//   JointMotion motion = reference.at(later);
//
// No allocation, no exceptions.
#pragma once

#include <array>

#include "common/arm_model.h"
#include "common/time.h"
#include "common/trapezoid.h"

namespace foresight {

struct JointMotion {
  JointVector position_rad, velocity_rad_per_s, acceleration_rad_per_s2;
};

class JointReference {
 public:
  explicit JointReference(const MotionLimits& limits) : limits_(limits) {}

  /// Begins at rest.
  void rest(Time now, const JointVector& position_rad);
  /// Begins in motion, and stops as fast as the limits allow until follow() is called.
  void begin(Time now, const JointVector& position_rad, const JointVector& velocity_rad_per_s);
  /// Goes to a target from wherever the reference is at `now` (≥ the last call's).
  void follow(Time now, const JointVector& target_rad);
  /// Ramps down to rest.
  void stop(Time now);

  /// `time` ≥ the last call's.
  JointMotion at(Time time) const;
  JointVector target_rad() const;
  bool is_at_rest(Time time) const;
  int size() const { return size_; }

 private:
  Trapezoid& joint(int index) { return joints_[static_cast<size_t>(index)]; }
  const Trapezoid& joint(int index) const { return joints_[static_cast<size_t>(index)]; }

  MotionLimits limits_;
  Time start_;
  int size_ = 0;
  std::array<Trapezoid, kMaxJoints> joints_;
};

}  // namespace foresight
