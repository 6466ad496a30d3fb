// Seeds: corners of keyframes whose depth is not known yet. In each placed image a seed is searched
// along the piece of its epipolar line that its depth range allows; a few well-separated sightings
// are kept, and inverse depth is fitted to all of them. A seed whose sightings agree from a large
// enough angle is mature and becomes a map point. Sightings hold poses relative to the source, so
// that bundle adjustment does not upset them.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "procs/slam/corner_detector.h"
#include "procs/slam/slam_map.h"
#include "procs/slam/slam_options.h"

namespace foresight::slam {

struct SeedSighting {
  Pose<Cam, Cam> view_from_source;
  Eigen::Vector2d xy;
  double scale_px = 1;  // px of the level per unit of xy
};

struct Seed {
  Corner corner;
  double inverse_depth = 1;     // 1/mu, of z in the source camera
  double low = 0.1, high = 10;  // its range
  double relative_sigma = 1;    // standard deviation / value
  double parallax_deg = 0;      // largest angle to a sighting
  double worst_error_px = 0;    // over the sightings
  int misses = 0;               // in a row
  std::vector<SeedSighting> sightings;
};

/// Fits inverse depth, range, parallax and errors to the sightings; drops one that contradicts the
/// others. False if they cannot agree.
bool fit_seed(Seed* seed);

/// The first look of a new keyframe: its corners, searched at once in keyframes that see the same.
/// Work for the worker: it owns what it needs (images are shared and never change).
struct SeedSearch {
  struct View {
    ImagePyramid pyramid;
    Pose<Map, Cam> map_from_cam;
  };
  KeyframeId keyframe_id;
  View keyframe;
  double median_depth = 1;
  OccupancyMask occupied;  // where there are points or seeds already
  std::vector<View> others;
};
/// Pure; about 10 ms.
std::vector<Seed> find_seeds(const CameraModel& camera, const SlamOptions& options,
                             SeedSearch search);

class DepthSeeds {
 public:
  DepthSeeds(const CameraModel& camera, const SlamOptions& options);

  void add(std::vector<Seed> seeds);
  /// Searches at most `max_searches` seeds in an image, continuing where the last call stopped.
  void search(const SlamMap& map, const ImagePyramid& pyramid, const Pose<Map, Cam>& map_from_cam,
              int max_searches);
  std::vector<Seed> take_mature();
  /// Gives up seeds that keep missing and those of keyframes before `oldest_keyframe_id`.
  void prune(KeyframeId newest_keyframe_id, int kept_keyframes);
  void forget_keyframe(KeyframeId id);
  /// The map around this keyframe grew by so much.
  void scale_keyframe(KeyframeId id, double factor);
  const std::vector<Seed>& seeds() const { return seeds_; }
  void clear() { seeds_.clear(); }

 private:
  CameraModel camera_;
  SlamOptions options_;
  std::vector<Seed> seeds_;
  size_t next_ = 0;  // round robin
};

}  // namespace foresight::slam
