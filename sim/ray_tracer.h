// Embree behind a small door: the scene's triangles and two questions, asked for 16 rays at a time,
// or one. One thread; the answers depend on nothing but the scene and the rays.
#pragma once

#include <embree3/rtcore.h>

#include <Eigen/Core>
#include <optional>

#include "sim/scene.h"

namespace foresight::sim {

class RayTracer {
 public:
  explicit RayTracer(const Scene& scene);
  ~RayTracer();
  RayTracer(const RayTracer&) = delete;
  RayTracer& operator=(const RayTracer&) = delete;

  /// Nearest triangle along each ray: hit.primID is its index in scene.triangles, hit.geomID is
  /// RTC_INVALID_GEOMETRY_ID where there is none. valid: −1 asks, 0 skips.
  void find_nearest(const int* valid, RTCRayHit16* rays) const;
  /// Sets tfar to −∞ for each ray that meets anything before its tfar.
  void find_blocked(const int* valid, RTCRay16* rays) const;
  /// How far the nearest triangle is from a point, in lengths of the direction; nothing where the
  /// ray meets nothing.
  std::optional<float> distance(const Eigen::Vector3f& from,
                                const Eigen::Vector3f& direction) const;

 private:
  RTCDevice device_;
  RTCScene scene_;
};

}  // namespace foresight::sim
