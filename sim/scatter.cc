#include "sim/scatter.h"

#include <algorithm>

#include "sim/random.h"

namespace foresight::sim {
namespace {

using Eigen::Vector3d;

constexpr int kDraws = 20;
constexpr double kNearest_m = 0.25;
constexpr int kRaysPerSide = 8;

// Uniform in the unit ball.
Vector3d draw_in_ball(Random& random) {
  while (true) {
    Vector3d point;
    for (double& coordinate : point) coordinate = random.uniform(-1, 1);
    if (point.squaredNorm() <= 1) return point;
  }
}

Pose<Cam, Cam> draw(Random& random, const ScatterParams& params) {
  const Vector3d shift = params.distance_m * draw_in_ball(random);
  const Vector3d axis = draw_in_ball(random).normalized();
  const double turn_rad = random.uniform(0, params.turn_rad);
  return {Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, axis)), shift};
}

std::vector<Vector3d> rays_of_middle(const CameraModel& camera) {
  std::vector<Vector3d> rays;
  for (int i = 0; i < kRaysPerSide * kRaysPerSide; ++i) {
    const double across = (i % kRaysPerSide + 0.5) / kRaysPerSide;
    const double down = (i / kRaysPerSide + 0.5) / kRaysPerSide;
    const Eigen::Vector2d pixel((0.25 + 0.5 * across) * camera.width_px,
                                (0.25 + 0.5 * down) * camera.height_px);
    rays.push_back(camera.unproject(pixel).homogeneous().normalized());
  }
  return rays;
}

}  // namespace

Scatter::Scatter(const Scene& scene, const CameraModel& camera, const ScatterParams& params)
    : params_(params), tracer_(scene), middle_rays_in_cam_(rays_of_middle(camera)) {}

bool Scatter::is_free(const Pose<World, Cam>& world_from_cam,
                      const Pose<World, Cam>& world_from_moved) const {
  const Eigen::Vector3f from = world_from_moved.translation().cast<float>();
  const Eigen::Vector3f back = world_from_cam.translation().cast<float>() - from;
  if (!back.isZero() && tracer_.distance(from, back).value_or(2) <= 1) return false;
  return std::none_of(middle_rays_in_cam_.begin(), middle_rays_in_cam_.end(),
                      [&](const Vector3d& ray_in_cam) {
                        const Vector3d ray_in_world = world_from_moved.rotation() * ray_in_cam;
                        const auto distance_m = tracer_.distance(from, ray_in_world.cast<float>());
                        return distance_m && *distance_m < kNearest_m;
                      });
}

Pose<Cam, Cam> Scatter::shift(const Pose<World, Cam>& world_from_cam, uint64_t seed) const {
  Random random(seed, "scatter");
  for (int i = 0; i < kDraws; ++i) {
    const Pose<Cam, Cam> cam_from_moved = draw(random, params_);
    if (is_free(world_from_cam, world_from_cam * cam_from_moved)) return cam_from_moved;
  }
  return {};
}

}  // namespace foresight::sim
