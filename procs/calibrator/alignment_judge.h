// Whether an alignment may be believed, and if not, which motion is missing.
#pragma once

#include "procs/calibrator/alignment.h"
#include "procs/calibrator/alignment_certainty.h"

namespace foresight::calibration {

/// Before solving: enough pairs, enough translation. Sets verdict and reason; true when it may go
/// on.
bool has_enough_motion(const AlignmentOptions& options, AlignmentSolution* solution);

/// After solving; `solution` has its numbers. Sets verdict and reason.
void judge(const AlignmentOptions& options, const Drift& drift, double second_axis_turn_rad,
           AlignmentSolution* solution);

}  // namespace foresight::calibration
