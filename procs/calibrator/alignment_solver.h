// Finds the alignment: eqs (4)–(6) for a start, then the paper's reprojection objective over all
// pairs with a robust loss (Ceres, one thread), then its certainty and what is missing.
// A pure function on copied data; the same problem gives the same bytes.
#pragma once

#include "procs/calibrator/alignment.h"

namespace foresight::calibration {

/// O(pairs² · points) for the start, O(pairs · points) per iteration; 150 pairs take about 50 ms.
AlignmentSolution solve_alignment(const AlignmentProblem& problem);

}  // namespace foresight::calibration
