// What does a view add to a map? A point is covered for a viewer if enough keyframes see it from
// nearly the same side and from about as near: another image from there shows nothing new of it,
// carves what is carved, and is found by what is there. So keyframes follow the room, however long
// a camera moves in it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "procs/slam/slam_map.h"

namespace foresight::slam {

/// Smaller maps are not thrifty: every keyframe makes them a little better.
inline constexpr size_t kThriftyKeyframes = 50;

/// Of a map as it is now: look at it before it changes.
class ViewCoverage {
 public:
  explicit ViewCoverage(const SlamMap& map);

  /// Share of these points that are covered for a viewer at `centre`, 0…1; 1 if there are none.
  double share(const std::vector<const Point*>& points, const Eigen::Vector3d& centre) const;
  /// What others than it cover of a keyframe's points.
  double share(const Keyframe& keyframe) const;

 private:
  bool covers(const Point& point, const Eigen::Vector3d& viewer, KeyframeId besides) const;

  const SlamMap& map_;
  IdVector<KeyframeId, Eigen::Vector3d> centres_;
};

}  // namespace foresight::slam
