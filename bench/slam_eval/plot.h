#pragma once

#include <string>

#include "bench/slam_eval/evaluation.h"

namespace foresight {

/// Truth (gray) and estimate (orange) in the planes xy, xz and yz, as an image file.
void plot_trajectory(const Evaluation& evaluation, const std::string& file);

}  // namespace foresight
