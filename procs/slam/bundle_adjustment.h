// Bundle adjustment: keyframe poses and points that minimise the robust reprojection error
// Σ ρ(‖(f/2^level)·(π(cam_from_map · X) − xy)‖²), with Ceres (one thread, Schur complement).
// A pure function on copied data; the same problem gives the same bytes.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "common/frames.h"
#include "common/id.h"

namespace foresight::slam {

enum class BundleRole { kAdjusted, kFixed };

/// Places in a problem and in its solution, which are no ids of the map.
using BundleKeyframeIndex = Id<struct BundleKeyframeTag>;
using BundlePointIndex = Id<struct BundlePointTag>;

struct BundleKeyframe {
  KeyframeId id;
  BundleRole role = BundleRole::kAdjusted;
  Pose<Map, Cam> map_from_cam;
};

struct BundlePoint {
  PointId id;
  Eigen::Vector3d position_in_map;
};

struct BundleObservation {
  BundleKeyframeIndex keyframe;
  BundlePointIndex point;
  Eigen::Vector2d xy;   // (x/z, y/z) of the ray
  double scale_px = 1;  // px of its pyramid level per unit of xy
};

struct BundleProblem {
  IdVector<BundleKeyframeIndex, BundleKeyframe> keyframes;
  IdVector<BundlePointIndex, BundlePoint> points;
  std::vector<BundleObservation> observations;
  int max_iterations = 10;
  /// Nothing outside holds the map's place: the solution is brought back to where it was.
  bool floats = false;
  double huber_px = 1.5;
  double outlier_px = 3.0;  // at its pyramid level: such observations are reported
};

struct BundleSolution {
  bool usable = false;
  IdVector<BundleKeyframeIndex, BundleKeyframe> keyframes;  // in the problem's order
  IdVector<BundlePointIndex, BundlePoint> points;
  std::vector<BundleObservation> outliers;
  double rms_px = 0;  // over the inliers
  struct Fit {
    int observations = 0;  // inliers
    double rms_px = 0;     // over these
  };
  IdVector<BundlePointIndex, Fit> fits;
};

BundleSolution adjust_bundle(const BundleProblem& problem);

/// What the observations say of the focal length. Turning and walking through a scene shows it; a
/// camera that only slides sideways does not (then both costs are about equal).
struct FocalCheck {
  bool usable = false;
  double factor = 1;      // true focal length / the given one, as it fits best
  double cost_ratio = 1;  // cost with that factor / with the given focal length

  /// The given focal length is wrong.
  bool contradicts() const;
};
/// Adjusts everything twice, the second time with a common factor on all projections.
FocalCheck check_focal_length(BundleProblem problem);

}  // namespace foresight::slam
