// A world of textured planes facing the z axis, drawn through homographies: images with exact poses
// for the SLAM tests.
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "procs/slam/gray_image_view.h"

namespace foresight {

/// 640 × 480, f = 500 px, no distortion.
CameraModel test_camera();

struct TexturedPlane {
  double depth_m = 4;  // z of the plane
  double left_m = -6, top_m = -6, width_m = 12, height_m = 12;
  cv::Mat texture;
};

class SyntheticScene {
 public:
  /// A far wall, a near panel and one in between, with random textures.
  explicit SyntheticScene(uint64_t seed);
  /// Only the far wall.
  static SyntheticScene wall(uint64_t seed);
  /// `world_from_cam` with z roughly along the world's z.
  cv::Mat render(const CameraModel& camera, const Pose<World, Cam>& world_from_cam) const;

 private:
  std::vector<TexturedPlane> planes_;  // far to near
};

GrayImageView view_of(const cv::Mat& image);

/// Sideways with a slight turn: `t` = 0…1 moves 0.8 m.
Pose<World, Cam> sideways_pose(double t);

}  // namespace foresight
