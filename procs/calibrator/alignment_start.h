// A first alignment from two pairs of poses: eqs (4)–(6).
#pragma once

#include <vector>

#include "procs/calibrator/alignment_residual.h"

namespace foresight::calibration {

/// E_m of a pair under the guessed hand-eye transform and delay.
Pose<Base, Cam> base_from_cam(const PosePair& pair, const AlignmentEstimate& guess);

/// Largest distance between two of the arm's camera centres, m.
double largest_baseline_m(const std::vector<SampledPair>& pairs, const AlignmentEstimate& guess);

/// Eq. (6) on the pair and the one farthest from it, eq. (5) on the pair itself; of the results of
/// all pairs whose baseline is at least half the largest, the one with the least median error over
/// all pairs, so that single mistracked poses do not spoil the start. O(n²) reprojections.
AlignmentEstimate start_alignment(const std::vector<SampledPair>& pairs, const CameraModel& camera,
                                  const AlignmentEstimate& guess);

}  // namespace foresight::calibration
