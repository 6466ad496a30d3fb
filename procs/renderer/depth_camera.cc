#include "procs/renderer/depth_camera.h"

#include <algorithm>
#include <cmath>

namespace foresight {
namespace {

constexpr double kMaxTangent = 4.0;  // 76°
constexpr int kBorderSteps = 16;

struct Extent {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e9);
  Eigen::Vector2d high = Eigen::Vector2d::Constant(-1e9);

  void add(const CameraModel& camera, double u_share, double v_share) {
    const Eigen::Vector2d xy =
        camera.unproject({u_share * camera.width_px - 0.5, v_share * camera.height_px - 0.5});
    if (!xy.allFinite()) return;
    const Eigen::Vector2d limit = Eigen::Vector2d::Constant(kMaxTangent);
    const Eigen::Vector2d kept = xy.cwiseMax(-limit).cwiseMin(limit);
    low = low.cwiseMin(kept);
    high = high.cwiseMax(kept);
  }
};

Extent extent_of(const CameraModel& camera) {
  Extent extent;
  for (int i = 0; i <= kBorderSteps; ++i) {
    const double share = static_cast<double>(i) / kBorderSteps;
    extent.add(camera, share, 0);
    extent.add(camera, share, 1);
    extent.add(camera, 0, share);
    extent.add(camera, 1, share);
  }
  if ((extent.high - extent.low).minCoeff() > 1e-6) return extent;
  return {Eigen::Vector2d::Constant(-1), Eigen::Vector2d::Constant(1)};  // a lens without sense
}

int texels(double wanted, int limit) {
  return std::clamp(static_cast<int>(std::lround(std::min(wanted, 1e6))), 2, std::max(limit, 2));
}

}  // namespace

DepthMapSize depth_map_size(const CameraModel& camera, double scale) {
  const Extent extent = extent_of(camera);
  const Eigen::Vector2d span = extent.high - extent.low;
  return {texels(span.x() * camera.fx_px * scale, camera.width_px),
          texels(span.y() * camera.fy_px * scale, camera.height_px)};
}

CameraModel depth_camera_for(const CameraModel& camera, int width_px, int height_px) {
  const Extent extent = extent_of(camera);
  const Eigen::Vector2d span = extent.high - extent.low;
  CameraModel pinhole = camera.undistorted();
  pinhole.width_px = width_px;
  pinhole.height_px = height_px;
  pinhole.fx_px = width_px / span.x();
  pinhole.fy_px = height_px / span.y();
  pinhole.cx_px = -extent.low.x() * pinhole.fx_px - 0.5;
  pinhole.cy_px = -extent.low.y() * pinhole.fy_px - 0.5;
  return pinhole;
}

}  // namespace foresight
