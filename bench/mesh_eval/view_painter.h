// Paints what a camera sees of a mesh with the images of keyframes, as an operator would see it:
// each point with the nearest image, taken early enough, in which nothing hides it.
#pragma once

#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "bench/mesh_eval/mesh_view.h"
#include "bench/slam_eval/sequence.h"
#include "common/map_delta.h"

namespace foresight {

class ViewPainter {
 public:
  /// `occluders`: what hides; must outlive the painter. Images are made smaller by `step`.
  ViewPainter(const Sequence& sequence, const MeshView& occluders,
              std::vector<MapKeyframe> keyframes, int step);

  /// Paints over `picture` (BGR, one pixel for each ray) with keyframes of up to `latest`; pixels
  /// that none of them sees stay as they are.
  void paint(const SeenMesh& seen, const PixelRays& rays, const Pose<Map, Cam>& map_from_cam,
             Time latest, cv::Mat* picture);

 private:
  std::vector<MapKeyframe> nearest_first(const Pose<Map, Cam>& map_from_cam, Time latest) const;
  const cv::Mat& image_of(const MapKeyframe& keyframe);
  std::optional<Eigen::Vector2d> pixel_in(const MapKeyframe& keyframe,
                                          const Eigen::Vector3f& point_in_map) const;

  const Sequence& sequence_;
  const MeshView& occluders_;
  std::vector<MapKeyframe> keyframes_;
  CameraModel camera_;  // of the smaller images
  std::map<KeyframeId, cv::Mat> images_;
};

}  // namespace foresight
