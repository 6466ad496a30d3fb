// Turns the changes of the map into deltas, and remembers what the receivers know.
#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "common/camera_model.h"
#include "common/map_delta.h"
#include "procs/slam/slam_map.h"
#include "procs/slam/slam_options.h"

namespace foresight::slam {

class PublishedMap {
 public:
  PublishedMap(const CameraModel& camera, const SlamOptions& options);

  /// Confirmed points and their observations only; moves smaller than the threshold are held back.
  MapDelta take(SlamMap* map);
  MapDelta snapshot() const;
  size_t published_points() const { return points_.size(); }

 private:
  struct SentPoint {
    Eigen::Vector3f position_in_map;
    float sigma_mu = 0;
    std::vector<KeyframeId> keyframe_ids;  // sorted
  };
  void take_keyframe(const SlamMap& map, KeyframeId id, MapDelta* delta);
  void take_point(const SlamMap& map, PointId id, MapDelta* delta);
  double threshold_rad() const;

  CameraModel camera_;
  SlamOptions options_;
  std::map<KeyframeId, MapKeyframe> keyframes_;
  std::map<PointId, SentPoint> points_;
};

}  // namespace foresight::slam
