// Embree behind a small door: triangles and two questions, asked for 16 rays at a time, or one. One
// thread; the answers depend on nothing but the triangles and the rays.
#pragma once

#include <embree3/rtcore.h>

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>

#include "sim/scene.h"

namespace foresight::sim {

/// Where a single ray ends.
struct RayHit {
  float distance = 0;  // in lengths of the ray's direction
  int triangle = 0;
};

class RayTracer {
 public:
  explicit RayTracer(const Scene& scene);
  /// Any triangles, by the indices of their vertices.
  RayTracer(std::span<const Eigen::Vector3f> vertices,
            std::span<const std::array<int, 3>> triangles);
  ~RayTracer();
  RayTracer(const RayTracer&) = delete;
  RayTracer& operator=(const RayTracer&) = delete;

  /// Nearest triangle along each ray: hit.primID is its index, hit.geomID is
  /// RTC_INVALID_GEOMETRY_ID where there is none. valid: −1 asks, 0 skips.
  void find_nearest(const int* valid, RTCRayHit16* rays) const;
  /// Sets tfar to −∞ for each ray that meets anything before its tfar.
  void find_blocked(const int* valid, RTCRay16* rays) const;
  /// The nearest triangle along one ray; nothing where it meets nothing.
  std::optional<RayHit> nearest(const Eigen::Vector3f& from,
                                const Eigen::Vector3f& direction) const;
  /// How far that is, in lengths of the direction.
  std::optional<float> distance(const Eigen::Vector3f& from,
                                const Eigen::Vector3f& direction) const;

 private:
  RTCDevice device_;
  RTCScene scene_;
};

}  // namespace foresight::sim
