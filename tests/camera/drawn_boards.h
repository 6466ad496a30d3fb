// Calibration boards drawn through known lenses, ray by ray.
#pragma once

#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <vector>

#include "common/camera_model.h"
#include "procs/camera/lens_calibration.h"

namespace foresight {

/// 640 × 480, with a distortion that matters.
CameraModel camera_with(LensModel lens);

/// A texture of `texel_m` metres a texel whose origin is at (left, top) on the board.
struct Print {
  cv::Mat texture;
  double left_m, top_m, texel_m;
};

Print chessboard(const CalibrationBoard& board);
Print tags(const CalibrationBoard& board);
cv::Mat render(const CameraModel& camera, const Print& print,
               const Eigen::Isometry3d& cam_from_board);

/// The board in the middle, in the corners, tilted, near and far.
std::vector<Eigen::Isometry3d> poses(double focal_px, double width_m, double height_m);

}  // namespace foresight
