// A world of textured rectangles, drawn by casting a ray through each pixel: images with exact
// poses for the SLAM tests, through any camera model.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "procs/slam/gray_image_view.h"

namespace foresight {

/// 640 × 480, f = 500 px, no distortion.
CameraModel test_camera();

/// A parallelogram: the texture's first column runs along `down`, its first row along `right`.
struct TexturedPlane {
  Eigen::Vector3d corner, right, down;  // m
  cv::Mat texture;
};

/// Blobs of several sizes: corners on every pyramid level.
cv::Mat random_texture(cv::RNG* rng, int size_px);

class SyntheticScene {
 public:
  explicit SyntheticScene(std::vector<TexturedPlane> planes) : planes_(std::move(planes)) {}
  /// A far wall, a near panel and one in between, with random textures, all facing the z axis.
  explicit SyntheticScene(uint64_t seed);
  /// Only the far wall.
  static SyntheticScene wall(uint64_t seed);
  /// Four walls around the origin, 2.5 to 3.2 m away, with panels in front of them.
  static SyntheticScene room(uint64_t seed);
  /// The same, but each wall looks like the others.
  static SyntheticScene room_of_equal_walls(uint64_t seed);

  cv::Mat render(const CameraModel& camera, const Pose<World, Cam>& world_from_cam) const;
  /// What a pixel shows, if it shows anything.
  std::optional<Eigen::Vector3d> point_at(const CameraModel& camera,
                                          const Pose<World, Cam>& world_from_cam,
                                          const Eigen::Vector2d& pixel) const;

 private:
  SyntheticScene() = default;
  std::vector<TexturedPlane> planes_;
};

GrayImageView view_of(const cv::Mat& image);

/// Sideways with a slight turn: `t` = 0…1 moves 0.8 m.
Pose<World, Cam> sideways_pose(double t);

/// Out of focus, 0.8 m nearer and rolled by 40 degrees: in the middle of the scene, nothing but a
/// hint finds this view in a map that sideways_pose() made.
Pose<Cam, Cam> bent_over();
cv::Mat out_of_focus(const cv::Mat& sharp);

/// Sideways, looking about, which shows the focal length.
Pose<World, Cam> winding_pose(double t);

/// On a ring in the room, looking outward: `t` = 0…1 goes round once. Here y is down.
Pose<World, Cam> ring_pose(double t);

}  // namespace foresight
