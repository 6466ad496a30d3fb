// How true are the map's points? Each depth image is compared with the points that the keyframe
// nearest in time observes, seen from the live pose of that image. One scale for the whole sequence
// (the median of true by estimated depth) makes them comparable; true poses are not needed.
#pragma once

#include <map>
#include <vector>

#include "bench/slam_eval/sequence.h"
#include "common/frames.h"
#include "common/map_delta.h"
#include "procs/camera/input_report.h"

namespace foresight {

struct DepthCheck {
  int compared = 0;
  double within_5_percent = 0;  // share of the compared
  double within_10_percent = 0;
  double in_front_10_percent = 0;   // share: floats in free space; ruins a carved model
  double median_error_percent = 0;  // absolute, of depth
  double within_2_sigma = 0;        // share of the compared, by the points' own uncertainty
  double metres_per_mu = 0;
};

/// `live_poses`: at the times of depth images; others are passed over. `report`: which of the depth
/// images that were wanted could be used.
DepthCheck check_depth(const Sequence& sequence, const MapDelta& snapshot,
                       const std::map<KeyframeId, Time>& keyframe_times,
                       const std::map<Time, Pose<Map, Cam>>& live_poses, InputReport* report);

}  // namespace foresight
