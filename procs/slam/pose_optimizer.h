// Camera pose from points whose positions are known: robust Gauss–Newton on the reprojection error.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/frames.h"

namespace foresight::slam {

struct PoseObservation {
  Eigen::Vector3d point_in_map;
  Eigen::Vector2d xy;   // where it was seen, (x/z, y/z) of the ray
  double scale_px = 1;  // px of its pyramid level per unit of xy: f / 2^level
};

struct PoseEstimate {
  Pose<Map, Cam> map_from_cam;
  std::vector<double> error_px;  // per observation, at its level; huge behind the camera
  double sigma_px = 0;           // robust standard deviation of the errors
  double min_information = 0;    // smallest eigenvalue of the normal matrix; ~0: undetermined
};

/// Huber weights first, then Tukey with a cut at max(2.5 px, 4 sigma) that gross errors cannot
/// pull.
PoseEstimate optimize_pose(const Pose<Map, Cam>& start,
                           const std::vector<PoseObservation>& observations);

}  // namespace foresight::slam
