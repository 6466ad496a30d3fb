// Scores of a run against the truth, after a Sim(3) alignment of the placed images.
#pragma once

#include "bench/slam_eval/evaluation.h"

namespace foresight {

/// Fills tracked_fraction, first_frame, init_s, ATE, RPE, wrong poses, quality, recovery and paths
/// from `answers`.
void score(const Sequence& sequence, Evaluation* evaluation);

/// Value at share q of the sorted values; 0 for none.
double quantile(std::vector<double> values, double q);

}  // namespace foresight
