// Places one image in the map: a coarse search for a few points with a wide radius, then a fine one
// for many, each followed by a robust pose.
#pragma once

#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "procs/slam/point_finder.h"
#include "procs/slam/slam_map.h"
#include "procs/slam/slam_options.h"

namespace foresight::slam {

enum class SearchWidth {
  kNarrow,  // the prediction is good to about 25 px
  kWide,    // to about 80 px
};

struct TrackingAttempt {
  Pose<Map, Cam> map_from_cam;
  std::vector<PointId> searched;    // points looked for in the fine search
  std::vector<PointMatch> inliers;  // sorted by point id
  /// Inliers / expected from each point's history, at most 1; scaled down below
  /// 2 × min_found_points inliers: few points are weak evidence.
  double quality = 0;
  double sigma_px = 0;  // of the reprojection errors
};

TrackingAttempt track_points(const CameraModel& camera, const SlamMap& map,
                             const ImagePyramid& pyramid, const Pose<Map, Cam>& predicted,
                             SearchWidth width, const SlamOptions& options);

/// Every other visible point, looked for with a pose that is good: for a new keyframe.
std::vector<PointMatch> find_remaining_points(const CameraModel& camera, const SlamMap& map,
                                              const ImagePyramid& pyramid,
                                              const Pose<Map, Cam>& map_from_cam,
                                              const std::vector<PointId>& already_searched,
                                              const SlamOptions& options);

/// Tells the points that were looked for whether they were found. A poor attempt says little about
/// them (blur, occlusion) and does not count.
void count_predictions(const TrackingAttempt& attempt, SlamMap* map);

}  // namespace foresight::slam
