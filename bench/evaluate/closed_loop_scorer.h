// Scores the closed loop against what really happened in the simulated world:
//   · the predicted pose of each shown picture against where the camera really was at the predicted
//     instant (mm, degrees, px of the true surface),
//   · the predicted picture, the delayed video and its best homography against the true view then,
//   · the alignment of map and robot, and the base's pose, against the truth.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "bench/evaluate/picture_scorer.h"
#include "sim/swarm/closed_loop.h"

namespace foresight {

/// Distance of two poses.
struct PoseError {
  double time_s = 0;  // since the start, of the instant that was estimated
  double position_mm = 0;
  double angle_deg = 0;
  double shift_px = 0;  // median over the picture; predictions only
};

/// Position and turn of the base about the vertical, true and estimated.
struct BaseSample {
  double time_s = 0;
  double true_m[3] = {}, estimated_m[3] = {};
  double true_yaw_deg = 0, estimated_yaw_deg = 0;
};

struct ClosedLoopResult : PictureScores {
  std::string name;
  double delay_s = 0, seconds = 0;
  int drawn_frames = 0;         // pictures since the first predicted view
  int predicted_frames = 0;     // of these, with a predicted view
  double first_aligned_s = -1;  // since the start; −1: never
  double first_prediction_s = -1;
  std::vector<PoseError> predictions;  // of every predicted view
  std::vector<PoseError> commands;     // the same, had the commanded joints been shown
  std::vector<PoseError> alignment;    // of each tracked frame while the base stands still
  std::vector<PoseError> base;         // of each BASE_POSE from 2 s after the alignment
  std::vector<BaseSample> base_path;
  double scale_error = 0;    // of the final alignment, relative
  double tracked_share = 0;  // of the frames after slam's start
  double max_camera_speed_m_per_s = 0;
  int controller_faults = 0;
  int map_points = 0, keyframes = 0, triangles = 0;
};

struct ClosedLoopScoring {
  int every = 15;  // score the picture of each Nth predicted view; poses are all scored
  int grid_rows = 5;
  std::string log_folder = {};  // for robot.lcmlog and operator.lcmlog; empty: none
};

ClosedLoopResult evaluate(const ClosedLoopOptions& options, const ClosedLoopScoring& scoring,
                          const std::function<void(double share)>& progress);

}  // namespace foresight
