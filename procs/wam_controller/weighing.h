// Whether the torques that hold an arm at rest are those of its weight, as the model says it: if
// not, its joints are not where they are believed to be, or something else pulls.
//
//   Weighing weighing(3.0, joint_count);
//   weighing.begin();                              // a new rest
//   weighing.add(dt_s, torque_nm - weight_nm);     // at each step of it
//   if (weighing.result() == Weighing::Result::kContradicts) …
//
// The difference is smoothed over a fifth of a second and judged from the end of the first second
// on. Friction is in it, so the tolerance is above that. No allocation, no exceptions.
#pragma once

#include "common/arm_model.h"

namespace foresight {

class Weighing {
 public:
  enum class Result : uint8_t { kUnknown, kAgrees, kContradicts };

  Weighing(double tolerance_nm, int joint_count)
      : tolerance_nm_(tolerance_nm), excess_nm_(JointVector::Zero(joint_count)) {}

  /// Forgets the result, too.
  void reset() {
    result_ = Result::kUnknown;
    pause();
  }
  /// No rest now: the result stands until the next one is judged.
  void pause() {
    rested_s_ = 0;
    excess_nm_.setZero();
  }
  void add(double dt_s, const JointVector& excess_nm) {
    excess_nm_ += dt_s / (dt_s + kSmoothing_s) * (excess_nm - excess_nm_);
    rested_s_ += dt_s;
    if (rested_s_ < kJudgedAfter_s) return;
    result_ = error_nm() > tolerance_nm_ ? Result::kContradicts : Result::kAgrees;
  }
  Result result() const { return result_; }
  double error_nm() const { return excess_nm_.cwiseAbs().maxCoeff(); }
  /// The joint with the largest error.
  int worst_joint() const {
    Eigen::Index joint = 0;
    excess_nm_.cwiseAbs().maxCoeff(&joint);
    return static_cast<int>(joint);
  }

 private:
  static constexpr double kSmoothing_s = 0.2, kJudgedAfter_s = 1;

  double tolerance_nm_;
  JointVector excess_nm_;
  double rested_s_ = 0;
  Result result_ = Result::kUnknown;
};

}  // namespace foresight
