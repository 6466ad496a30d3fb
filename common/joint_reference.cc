#include "common/joint_reference.h"

#include <algorithm>

#include "common/check.h"

namespace foresight {
namespace {

double since(Time start, Time time) { return std::max(0.0, (time - start).seconds()); }

}  // namespace

void JointReference::rest(Time now, const JointVector& position_rad) {
  begin(now, position_rad, JointVector::Zero(position_rad.size()));
}

void JointReference::begin(Time now, const JointVector& position_rad,
                           const JointVector& velocity_rad_per_s) {
  FORESIGHT_CHECK(velocity_rad_per_s.size() == position_rad.size());
  start_ = now;
  size_ = static_cast<int>(position_rad.size());
  for (int i = 0; i < size_; ++i) {
    joint(i) = Trapezoid::stop({position_rad[i], velocity_rad_per_s[i], 0}, limits_);
  }
}

void JointReference::follow(Time now, const JointVector& target_rad) {
  FORESIGHT_CHECK(target_rad.size() == size_);
  const double time_s = since(start_, now);
  for (int i = 0; i < size_; ++i) {
    joint(i) = Trapezoid::fit(joint(i).at(time_s), target_rad[i], limits_);
  }
  start_ = std::max(start_, now);
}

void JointReference::stop(Time now) {
  const double time_s = since(start_, now);
  for (int i = 0; i < size_; ++i) joint(i) = Trapezoid::stop(joint(i).at(time_s), limits_);
  start_ = std::max(start_, now);
}

JointMotion JointReference::at(Time time) const {
  const double time_s = since(start_, time);
  JointMotion motion{JointVector(size_), JointVector(size_), JointVector(size_)};
  for (int i = 0; i < size_; ++i) {
    const MotionState state = joint(i).at(time_s);
    motion.position_rad[i] = state.position;
    motion.velocity_rad_per_s[i] = state.velocity;
    motion.acceleration_rad_per_s2[i] = state.acceleration;
  }
  return motion;
}

JointVector JointReference::target_rad() const {
  JointVector target(size_);
  for (int i = 0; i < size_; ++i) target[i] = joint(i).target();
  return target;
}

bool JointReference::is_at_rest(Time time) const {
  const double time_s = since(start_, time);
  for (int i = 0; i < size_; ++i) {
    if (time_s < joint(i).duration_s()) return false;
  }
  return true;
}

}  // namespace foresight
