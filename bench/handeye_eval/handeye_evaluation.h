// Scores hand-eye answers on recorded data: with the camera placed by the robot, how far are the
// target's corners from where they were seen, and how far apart do the views put the target?
#pragma once

#include <string>
#include <vector>

#include "bench/handeye_eval/handeye_methods.h"

namespace foresight {

struct HandEyeScore {
  HandEyeAnswer answer;
  // Corners through the robot's chain, in distorted pixels; zero without corners.
  double median_px = 0, p90_px = 0, worst_view_px = 0;  // the last: median of the worst view
  // Distance of the target, as each view and the robot place it, from its mean.
  double median_mm = 0, p90_mm = 0;
  // Against the data's reference, where there is one.
  double camera_shift_mm = 0, camera_turn_deg = 0;
};

struct HandEyeEvaluation {
  std::string dataset;
  int views = 0;
  bool has_corners = false, has_reference = false;
  calibration::AlignmentSolution solution;  // ours
  std::vector<HandEyeScore> scores;         // ours first
};

HandEyeEvaluation evaluate_handeye(const HandEyeData& data);

}  // namespace foresight
