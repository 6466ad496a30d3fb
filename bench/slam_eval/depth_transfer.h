// A judge of relative poses that needs no true pose: corners of one image, with the depth that its
// depth image gives them, are found in a later image (Lucas-Kanade, there and back). How far off
// does a relative pose carry them, and how far is it from the pose that fits them best
// (perspective-n-point)? Says what the truth itself is worth: tag boards, structure from motion and
// hand-held sensors leave errors of their own.
#pragma once

#include <functional>
#include <optional>

#include "bench/slam_eval/sequence.h"

namespace foresight {

struct DepthTransfer {
  int pairs = 0;
  // Medians over the pairs; −1: nothing to compare.
  double px = -1;          // of the median over corners
  double from_fit_m = -1;  // distance of the relative pose from the one that fits best
  double from_fit_deg = -1;
};

/// Pose of the camera at a time, in metres, in any fixed frame.
using MetricPoseAt = std::function<std::optional<Pose<World, Cam>>(Time)>;

/// Over all pairs of depth images about `apart` from each other at whose times every one of `poses`
/// has an answer; one result for each of `poses`.
std::vector<DepthTransfer> transfer_through_depth(const Sequence& sequence, Duration apart,
                                                  const std::vector<MetricPoseAt>& poses);

}  // namespace foresight
