// Well-spread corners of a pyramid: FAST candidates ranked by the Shi–Tomasi score, a share of the
// budget per level, the best few of each image cell, none closer than a few pixels to another.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "common/camera_model.h"
#include "procs/slam/image_pyramid.h"
#include "procs/slam/slam_map.h"

namespace foresight::slam {

struct DetectedCorner {
  Eigen::Vector2d pixel;  // of the full image
  int level = 0;
};

/// Marks where no new corner is wanted.
class OccupancyMask {
 public:
  OccupancyMask(int width_px, int height_px);
  void add(const Eigen::Vector2d& pixel, double radius_px);
  bool contains(const Eigen::Vector2d& pixel) const;

 private:
  cv::Mat mask_;
};

/// At most `count` corners outside `occupied` (which they are added to).
std::vector<DetectedCorner> detect_corners(const ImagePyramid& pyramid, int count,
                                           OccupancyMask* occupied);

/// Rays of the corner and its neighbours; empty if they leave the camera model.
std::optional<Corner> make_corner(const CameraModel& camera, KeyframeId keyframe_id,
                                  const DetectedCorner& detected);

}  // namespace foresight::slam
