// How well a lost camera finds itself: single images from around the map's views, each shown to a
// core that knows the map and nothing else.
#pragma once

#include <string>
#include <vector>

#include "bench/slam_eval/sequence.h"
#include "procs/slam/slam.h"

namespace foresight {

/// One query image, shown again and again as to a camera that stands still.
struct RelocalisationTrial {
  std::string path;
  // To the keyframe that is nearest by truth, 1 m counting as much as 67° (30 cm as 20°).
  double distance_m = 0, angle_deg = 0;
  int images = -1;                    // shown until it was placed; −1: never
  double error_m = 0, error_deg = 0;  // of the placed, after aligning the map with the truth
  double quality = 0;
  double first_ms = 0;  // CPU time of the first image

  bool placed() const { return images > 0; }
  bool right() const { return placed() && error_m < 0.05 && error_deg < 5; }
  bool wrong() const { return placed() && (error_m > 0.1 || error_deg > 10); }
};

struct RelocalisationRange {
  int start = 0, every = 1;  // images of the query sequence
  int images = 9;            // shown of each: 0.3 s at 30 Hz
  bool hint = false;         // tell it the pose, off by 3 cm and 2°, as an arm might
};

/// Every trial begins lost. Throws UnavailableError where the map's keyframes have no truth, or an
/// image cannot be read.
std::vector<RelocalisationTrial> try_to_relocalise(const StoredMap& map, const Sequence& mapped,
                                                   const Sequence& queries,
                                                   const SlamOptions& options,
                                                   const RelocalisationRange& range);

/// Recall by distance from the map's views, wrong placements and times, a table of a few lines.
std::string describe(const std::vector<RelocalisationTrial>& trials);

}  // namespace foresight
