// Finds map points and seeds in an image: the patch of the source corner, carried into the view by
// an affine warp, is searched near its prediction and aligned to sub-pixel accuracy (PTAM's search,
// with normalised correlation on all pixels instead of FAST corners, so that blur does not hide
// it).
#pragma once

#include <map>
#include <optional>

#include "common/camera_model.h"
#include "common/frames.h"
#include "procs/slam/patch.h"
#include "procs/slam/slam_map.h"

namespace foresight::slam {

/// How a corner would look in another view.
struct PatchView {
  Eigen::Vector2d pixel;  // of the full image
  double depth = 0;       // z in the other camera
  int level = 0;          // of the other pyramid: where the patch has about its own size
  Eigen::Matrix2d source_from_patch;  // px of the source level per px of `level`
};

/// The corner at `depth` (z in its own camera), seen from another camera. Empty behind it, outside
/// its image, or when scale or slant are too different for the patch to be found.
std::optional<PatchView> view_corner(const CameraModel& camera, const Corner& corner, double depth,
                                     const Pose<Cam, Cam>& view_from_source);

struct PointMatch {
  PointId point_id;
  Observation observation;  // keyframe_id is left to the caller
};

struct PointSearch {
  double radius_px = 4;  // at the level of the search
  int extra_levels = 0;  // search so many levels coarser than natural (wide, or blurred)
  double min_zncc = 0.75;
};

/// Looks for points of a map in one image with one assumed pose.
class PointFinder {
 public:
  PointFinder(const CameraModel& camera, const SlamMap& map, const ImagePyramid& pyramid,
              const Pose<Map, Cam>& map_from_cam);

  const Pose<Cam, Map>& cam_from_map() const { return cam_from_map_; }
  /// Where the point should appear; empty if not visible.
  std::optional<PatchView> predict(const Point& point) const;
  std::optional<PointMatch> find(const Point& point, const PatchView& view,
                                 const PointSearch& search) const;
  const Pose<Cam, Cam>& view_from_keyframe(KeyframeId keyframe_id) const;

 private:
  const CameraModel& camera_;
  const SlamMap& map_;
  const ImagePyramid& pyramid_;
  Pose<Map, Cam> map_from_cam_;
  Pose<Cam, Map> cam_from_map_;
  mutable std::map<KeyframeId, Pose<Cam, Cam>> view_from_keyframe_;  // cache
};

}  // namespace foresight::slam
