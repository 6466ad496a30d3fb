// Where could a lost camera be? Poses to try, the most likely first. Nothing here is believed until
// track_points() has found enough of the map from there.
#pragma once

#include <optional>
#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "procs/slam/place_index.h"
#include "procs/slam/slam_map.h"

namespace foresight::slam {

/// The pose that fits an image's features best if they are matched with the points of one keyframe
/// (perspective-n-point after seeded RANSAC). Needs the keyframe's features.
std::optional<Pose<Map, Cam>> matched_view(const CameraModel& camera, const SlamMap& map,
                                           const Features& image, const Keyframe& keyframe);

class ViewCandidates {
 public:
  explicit ViewCandidates(const CameraModel& camera);

  /// Keyframes whose thumbnails look most like this one, turned to match it: cheap, for views near
  /// a keyframe.
  std::vector<Pose<Map, Cam>> similar_views(const SlamMap& map, const Thumbnail& thumbnail) const;

  /// Poses from features matched with the points of a few keyframes (those that look most alike
  /// first, others at each call) and perspective-n-point: about 30 ms, for other view points.
  std::vector<Pose<Map, Cam>> matched_views(const SlamMap& map, const PlaceIndex& places,
                                            const ImagePyramid& pyramid);
  /// After a success: the next loss starts with the most similar keyframes again.
  void restart() { next_rank_ = 0; }

 private:
  CameraModel camera_, thumbnail_camera_;
  size_t next_rank_ = 0;
};

}  // namespace foresight::slam
