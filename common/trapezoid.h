// Time-optimal motion of one joint with bounded velocity and acceleration from any position and
// velocity to rest at a target: the paper's truncated trapezoid (§II-D), re-fitted at each command.
//
//   const Trapezoid motion = Trapezoid::fit({position, velocity}, target, limits);
//   const MotionState now = motion.at(0.25);
//
// All cases: reversal, overshoot and return when the braking distance is longer than the way,
// triangle when the velocity limit is not reached, zero length, a start above the velocity limit
// (brakes to it first). No allocation, no exceptions. O(1).
#pragma once

#include <array>

namespace foresight {

struct MotionLimits {
  double velocity = 1;      // rad/s, > 0
  double acceleration = 1;  // rad/s², > 0
  bool operator==(const MotionLimits&) const = default;
};

struct MotionState {
  double position = 0;      // rad
  double velocity = 0;      // rad/s
  double acceleration = 0;  // rad/s²
};

class Trapezoid {
 public:
  /// At rest at 0.
  Trapezoid() = default;
  /// The fastest motion from `start` (its acceleration is not used) to rest at `target`.
  static Trapezoid fit(const MotionState& start, double target, const MotionLimits& limits);
  /// The fastest motion to rest, wherever that is.
  static Trapezoid stop(const MotionState& start, const MotionLimits& limits);

  /// State at a time ≥ 0 since the fit; at rest at the target after duration_s().
  MotionState at(double time_s) const;
  double duration_s() const;
  double target() const { return target_; }

 private:
  // Up to three pieces of constant acceleration, one after the other.
  struct Piece {
    double duration_s = 0;
    MotionState start;  // with the piece's acceleration
  };
  // Lays the pieces end to end; the first two end at the velocity `peak`.
  void chain(MotionState state, const std::array<double, 3>& accelerations, double peak);

  std::array<Piece, 3> pieces_;
  double target_ = 0;
};

}  // namespace foresight
