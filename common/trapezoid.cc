#include "common/trapezoid.h"

#include <algorithm>
#include <cmath>

namespace foresight {
namespace {

// Where braking from `start` at full acceleration ends, relative to its position.
double braking_way(double velocity, const MotionLimits& limits) {
  return velocity * std::abs(velocity) / (2 * limits.acceleration);
}

MotionState advance(const MotionState& start, double time_s) {
  return {start.position + time_s * (start.velocity + 0.5 * time_s * start.acceleration),
          start.velocity + time_s * start.acceleration, start.acceleration};
}

}  // namespace

// Let the surplus be the way beyond where immediate braking would end. The motion towards the
// surplus' side speeds up (from a velocity of either sign) to a peak, may cruise there, and brakes.
// Without a limit the peak follows from equating the ways:
//   (peak² − v²)/2A + peak²/2A = way,  that is  peak² = A·surplus + max(v, 0)²
// with v counted towards that side. Above the velocity limit the first piece slows down to it, and
// all of the surplus is cruised.
Trapezoid Trapezoid::fit(const MotionState& start, double target, const MotionLimits& limits) {
  const double signed_surplus = target - start.position - braking_way(start.velocity, limits);
  const double side = signed_surplus < 0 ? -1 : 1;
  const double surplus = std::abs(signed_surplus);
  const double velocity = side * start.velocity;
  const double forward = std::max(velocity, 0.0);
  double peak = std::sqrt(limits.acceleration * surplus + forward * forward);
  double cruise_s = 0;
  if (peak > limits.velocity) {
    peak = limits.velocity;
    const double reached = std::max(0.0, (peak - forward) * (peak + forward));
    cruise_s = (surplus - reached / limits.acceleration) / peak;
  }
  Trapezoid motion;
  motion.target_ = target;
  const double change = peak - velocity;
  motion.pieces_[0].duration_s = std::abs(change) / limits.acceleration;
  motion.pieces_[1].duration_s = std::max(0.0, cruise_s);
  motion.pieces_[2].duration_s = peak / limits.acceleration;
  motion.chain({start.position, start.velocity, 0},
               {side * std::copysign(limits.acceleration, change), 0, -side * limits.acceleration},
               side * peak);
  return motion;
}

Trapezoid Trapezoid::stop(const MotionState& start, const MotionLimits& limits) {
  return fit(start, start.position + braking_way(start.velocity, limits), limits);
}

void Trapezoid::chain(MotionState state, const std::array<double, 3>& accelerations, double peak) {
  for (size_t i = 0; i < pieces_.size(); ++i) {
    state.acceleration = accelerations[i];
    pieces_[i].start = state;
    state = advance(state, pieces_[i].duration_s);
    if (i < 2) state.velocity = peak;  // exactly, so that rounding cannot exceed the limit
  }
}

MotionState Trapezoid::at(double time_s) const {
  if (time_s >= duration_s()) return {target_, 0, 0};
  double left_s = std::max(0.0, time_s);
  for (const Piece& piece : pieces_) {
    if (left_s < piece.duration_s) return advance(piece.start, left_s);
    left_s -= piece.duration_s;
  }
  return {target_, 0, 0};
}

double Trapezoid::duration_s() const {
  return pieces_[0].duration_s + pieces_[1].duration_s + pieces_[2].duration_s;
}

}  // namespace foresight
