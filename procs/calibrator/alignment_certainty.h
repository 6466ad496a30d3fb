// How certain an alignment is, and how its pairs disagree with it.
//
// The errors of a pair's sample points are not independent: they come from one error ε of the
// pair's pose (SLAM's and the arm's together; six numbers, in camera axes). With r_i ≈ A_i ε_i,
// where A_i are the derivatives by a motion of the camera, the pair's disagreement is ε̂_i =
// (AᵀA)⁻¹Aᵀ r_i, its covariance P is estimated over the pairs, and that of the estimate is
//
//   H⁻¹ (Σ w_i² J_iᵀ A_i P A_iᵀ J_i) H⁻¹,     H = Σ w_i J_iᵀ J_i   (w: weights of the loss).
//
// Counting every point as a measurement of its own would make it √points too confident.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "procs/calibrator/alignment_minimiser.h"
#include "procs/calibrator/geometry.h"

namespace foresight::calibration {

struct Certainty {
  StepMatrix covariance;  // of the steps that were free; zero elsewhere
  bool is_determined = false;
  double position_sigma_m = 0;  // 3D, of the camera's centre in the base, RMS over the pairs
  double pair_position_error_m = 0, pair_rotation_error_rad = 0;  // RMS of ε̂

  /// 3D standard deviation of three consecutive steps.
  double sigma3(int first) const { return std::sqrt(covariance.block<3, 3>(first, first).trace()); }
  double sigma(int step) const { return std::sqrt(covariance(step, step)); }
};

Certainty certainty_of(const Minimisation& task, const PivotedEstimate& estimate,
                       const AlignmentOptions& options);

/// What the base would have moved from the first to the last pair, at the middle of the cameras, if
/// it moved steadily: estimated together with the alignment, because a motion of the arm in one
/// direction would otherwise hide a motion of the base.
struct Drift {
  bool is_determined = false;
  double shift_m = 0, shift_sigma_m = 0;  // sigmas: 3D
  double turn_rad = 0, turn_sigma_rad = 0;
};
Drift drift_of(const Minimisation& task, const PivotedEstimate& estimate,
               const AlignmentOptions& options);

/// RMS turn (rad) about the second of the principal axes about which the hand turns.
double second_axis_turn_rad(const std::vector<const SampledPair*>& pairs);

}  // namespace foresight::calibration
