// Where could a lost camera be? Poses to try, the most likely first. Nothing here is believed until
// track_points() has found enough of the map from there.
#pragma once

#include <map>
#include <opencv2/features2d.hpp>
#include <optional>
#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "procs/slam/slam_map.h"

namespace foresight::slam {

class Relocalizer {
 public:
  explicit Relocalizer(const CameraModel& camera);

  /// Keyframes whose thumbnails look most like this one, turned to match it: cheap, for views near
  /// a keyframe.
  std::vector<Pose<Map, Cam>> similar_views(const SlamMap& map, const Thumbnail& thumbnail) const;

  /// Poses from ORB features matched with the points of a few keyframes (other ones at each call,
  /// the most similar first) and perspective-n-point: about 30 ms, for other view points.
  std::vector<Pose<Map, Cam>> matched_views(const SlamMap& map, const ImagePyramid& pyramid,
                                            const Thumbnail& thumbnail);
  /// After a success: the next loss starts with the most similar keyframes again.
  void restart() { next_rank_ = 0; }

 private:
  struct Features {
    std::vector<cv::KeyPoint> keypoints;
    cv::Mat descriptors;
  };
  struct KeyframeFeatures {
    cv::Mat descriptors;
    std::vector<int32_t> point_ids;  // per row
  };
  Features detect(const ImagePyramid& pyramid) const;
  const KeyframeFeatures& features_of(const SlamMap& map, int32_t keyframe_id);
  std::optional<Pose<Map, Cam>> solve(const SlamMap& map, const Features& seen,
                                      const KeyframeFeatures& known) const;

  CameraModel camera_, thumbnail_camera_;
  cv::Ptr<cv::ORB> orb_;
  std::map<int32_t, KeyframeFeatures> cache_;
  size_t next_rank_ = 0;
};

}  // namespace foresight::slam
