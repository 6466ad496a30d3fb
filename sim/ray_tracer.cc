#include "sim/ray_tracer.h"

#include "common/check.h"

namespace foresight::sim {
namespace {

std::vector<Eigen::Vector3f> places(const Scene& scene) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(scene.vertices.size());
  for (const Vertex& vertex : scene.vertices) points.push_back(vertex.point_in_world);
  return points;
}

std::vector<std::array<int, 3>> corners(const Scene& scene) {
  std::vector<std::array<int, 3>> triangles;
  triangles.reserve(scene.triangles.size());
  for (const Triangle& triangle : scene.triangles) triangles.push_back(triangle.vertices);
  return triangles;
}

}  // namespace

RayTracer::RayTracer(const Scene& scene) : RayTracer(places(scene), corners(scene)) {}

RayTracer::RayTracer(std::span<const Eigen::Vector3f> points,
                     std::span<const std::array<int, 3>> triangles)
    : device_(rtcNewDevice("threads=1,set_affinity=0")), scene_(rtcNewScene(device_)) {
  FORESIGHT_CHECK(device_ != nullptr);
  // Robust: no light leaks between neighbours, which would look like corners to a tracker.
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), points.size()));
  for (const Eigen::Vector3f& point : points) {
    for (int axis = 0; axis < 3; ++axis) *vertices++ = point[axis];
  }
  auto* indices = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(unsigned), triangles.size()));
  for (const std::array<int, 3>& triangle : triangles) {
    for (const int vertex : triangle) *indices++ = static_cast<unsigned>(vertex);
  }
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene_, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene_);
  FORESIGHT_CHECK(rtcGetDeviceError(device_) == RTC_ERROR_NONE);
}

RayTracer::~RayTracer() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

void RayTracer::find_nearest(const int* valid, RTCRayHit16* rays) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect16(valid, scene_, &context, rays);
}

void RayTracer::find_blocked(const int* valid, RTCRay16* rays) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded16(valid, scene_, &context, rays);
}

std::optional<RayHit> RayTracer::nearest(const Eigen::Vector3f& from,
                                         const Eigen::Vector3f& direction) const {
  alignas(64) RTCRayHit16 rays{};
  alignas(64) int valid[16] = {-1};
  rays.ray.org_x[0] = from.x(), rays.ray.org_y[0] = from.y(), rays.ray.org_z[0] = from.z();
  rays.ray.dir_x[0] = direction.x(), rays.ray.dir_y[0] = direction.y();
  rays.ray.dir_z[0] = direction.z();
  rays.ray.tfar[0] = 1e6f, rays.ray.mask[0] = ~0u;
  rays.hit.geomID[0] = RTC_INVALID_GEOMETRY_ID;
  rays.hit.instID[0][0] = RTC_INVALID_GEOMETRY_ID;
  find_nearest(valid, &rays);
  if (rays.hit.geomID[0] == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  return RayHit{rays.ray.tfar[0], static_cast<int>(rays.hit.primID[0])};
}

std::optional<float> RayTracer::distance(const Eigen::Vector3f& from,
                                         const Eigen::Vector3f& direction) const {
  const auto hit = nearest(from, direction);
  return hit ? std::optional(hit->distance) : std::nullopt;
}

}  // namespace foresight::sim
