// Grows and cleans the map on the main thread: when to make a keyframe, what goes into it, new
// points from mature seeds, probation and culling. What is adjusted together: map_adjustment.h.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "procs/slam/depth_seeds.h"
#include "procs/slam/frame.h"
#include "procs/slam/initializer.h"
#include "procs/slam/loop_correction.h"
#include "procs/slam/map_adjustment.h"
#include "procs/slam/slam_map.h"
#include "procs/slam/slam_options.h"
#include "procs/slam/tracker.h"

namespace foresight::slam {

class Mapper {
 public:
  Mapper(const CameraModel& camera, const SlamOptions& options);

  /// Fills an empty map.
  void begin(const InitialMap& initial, SlamMap* map);
  bool wants_keyframe(const SlamMap& map, Time time, const TrackingAttempt& tracking) const;
  KeyframeId insert_keyframe(const Frame& frame, const TrackingAttempt& tracking, SlamMap* map);
  /// Every placed image: searches seeds and turns mature ones into points.
  void grow(const Frame& frame, const Pose<Map, Cam>& map_from_cam, SlamMap* map);

  /// At the end of an image that became no keyframe: looks over the points now and then.
  void review_if_due(SlamMap* map);
  /// Work on a new keyframe, if there is some, for find_seeds().
  std::optional<SeedSearch> take_seed_search(const SlamMap& map);
  void add_seeds(KeyframeId keyframe_id, std::vector<Seed> seeds, SlamMap* map);
  /// Because of the memory limit, since the map began.
  int forgotten_keyframes() const { return forgotten_keyframes_; }

  /// Returns how the map moved around the newest adjusted keyframe.
  Similarity<Map, Map> apply(const BundleProblem& problem, const BundleSolution& solution,
                             SlamMap* map);
  /// A loop was closed: moves everything, and makes one of points that are the same.
  void apply(const MapCorrection& correction, const LoopClosure& closure, SlamMap* map);

 private:
  Observation second_observation(const SlamMap& map, PointId point_id,
                                 const Eigen::Vector2d& followed_px) const;
  SeedSearch seed_search(KeyframeId keyframe_id, const SlamMap& map) const;
  /// A keyframe as the source of new points: where it has points, and who sees the same scene.
  struct SourceView {
    std::vector<std::pair<KeyframeId, PointFinder>> neighbours;
    OccupancyMask occupied;
  };
  SourceView source_view(const SlamMap& map, KeyframeId keyframe_id) const;
  void make_points(SlamMap* map);
  void make_point(const Seed& seed, SourceView* view, SlamMap* map);
  void review_points(SlamMap* map);
  /// Removes those that add nothing, and over the memory limit those that add least.
  void cull_keyframes(SlamMap* map);
  bool overlaps(const SlamMap& map, const PointFinder& finder, const Keyframe& keyframe) const;
  void remove_keyframe(KeyframeId id, SlamMap* map);
  double wanted_baseline(const SlamMap& map, double depth) const;

  CameraModel camera_;
  SlamOptions options_;
  DepthSeeds seeds_;
  int images_since_review_ = 0;
  int forgotten_keyframes_ = 0;
  std::deque<KeyframeId> unseeded_;  // keyframes whose seeds have not been looked for
};

}  // namespace foresight::slam
