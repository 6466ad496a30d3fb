// Where could a lost camera be? Poses to try, the most likely first. Nothing here is believed until
// track_points() has found enough of the map from there.
#pragma once

#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "procs/slam/slam_map.h"

namespace foresight::slam {

class Relocalizer {
 public:
  explicit Relocalizer(const CameraModel& camera);

  /// Keyframes whose thumbnails look most like this one, turned to match it.
  std::vector<Pose<Map, Cam>> similar_views(const SlamMap& map, const Thumbnail& thumbnail) const;

 private:
  CameraModel camera_, thumbnail_camera_;
};

}  // namespace foresight::slam
