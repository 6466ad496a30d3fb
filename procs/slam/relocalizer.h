// Finds a lost camera in its map, and doubts a camera that may only seem to be placed: candidates
// come cheapest first, each has to be confirmed by enough of the map (docs/algorithms/slam.md,
// step 18).
#pragma once

#include <optional>
#include <vector>

#include "procs/slam/frame.h"
#include "procs/slam/place_index.h"
#include "procs/slam/slam_map.h"
#include "procs/slam/slam_options.h"
#include "procs/slam/tracker.h"
#include "procs/slam/view_candidates.h"

namespace foresight::slam {

class Relocalizer {
 public:
  Relocalizer(const CameraModel& camera, const SlamOptions& options);

  /// Where the camera should be at about this time; of use for a fraction of a second.
  void hint(Time time, const Pose<Map, Cam>& map_from_cam) { hint_ = {time, map_from_cam}; }
  /// The best attempt to place the image, good enough or not: at the hint, where it was predicted,
  /// at similar keyframes, then by features.
  TrackingAttempt find(const SlamMap& map, PlaceIndex& places, const Frame& frame,
                       const Pose<Map, Cam>& predicted);
  /// Whether that is enough to end a loss: more than it takes to go on tracking.
  bool accepts(const TrackingAttempt& attempt) const;
  /// Another place that claims an image with far more points than it was placed with; quality 0 if
  /// there is none. Looks now and then only, and when the image's quality is doubtful.
  TrackingAttempt rival(const SlamMap& map, const Frame& frame, const TrackingAttempt& placed);
  /// After a success: the next loss starts with the most similar keyframes again.
  void restart() { candidates_.restart(); }

 private:
  TrackingAttempt best_attempt(const SlamMap& map, const Frame& frame,
                               const std::vector<Pose<Map, Cam>>& poses) const;

  struct Hint {
    Time time;
    Pose<Map, Cam> map_from_cam;
  };

  CameraModel camera_;
  SlamOptions options_;
  ViewCandidates candidates_;
  std::optional<Hint> hint_;
  int doubtful_frames_ = 0;  // in a row
};

}  // namespace foresight::slam
