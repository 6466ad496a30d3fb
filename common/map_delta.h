// What changed in the SLAM map: the core type behind the message map_delta_t (slam → carver).
// A snapshot is a delta that is applied to an empty map. Entries are upserts: `..._set` carries a
// new element or the new value of a known one, so that applying an element twice is harmless.
// Order of application: observations_removed, points_removed, keyframes_removed, keyframes_set,
// points_set, observations_added. Removing a point or a keyframe removes its observations too.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/frames.h"
#include "common/id.h"
#include "common/time.h"

namespace foresight {

struct MapKeyframe {
  KeyframeId id;
  Pose<Map, Cam> map_from_cam;
  Time time = {};  // of its image
};

struct MapPoint {
  PointId id;
  Eigen::Vector3f position_in_map = Eigen::Vector3f::Zero();
  float sigma_mu = 0;  // standard deviation of the position along the view; 0: not known
};

/// Keyframe `keyframe_id` saw point `point_id`. The carver makes it a constraint: the segment
/// between them is free space.
struct MapObservation {
  KeyframeId keyframe_id;
  PointId point_id;
  auto operator<=>(const MapObservation&) const = default;
};

struct MapDelta {
  std::vector<MapObservation> observations_removed;
  std::vector<PointId> points_removed;
  std::vector<KeyframeId> keyframes_removed;
  std::vector<MapKeyframe> keyframes_set;
  std::vector<MapPoint> points_set;
  std::vector<MapObservation> observations_added;

  bool empty() const {
    return observations_removed.empty() && points_removed.empty() && keyframes_removed.empty() &&
           keyframes_set.empty() && points_set.empty() && observations_added.empty();
  }
};

}  // namespace foresight
