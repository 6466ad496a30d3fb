// Views around a path: each picture's pose is moved on its own, as that of somebody who stood
// elsewhere. For tests of finding back to a place known from another way.
//
//   const Scatter scatter(scene, camera, {.distance_m = 0.3, .turn_rad = 0.35});
//   Pose<World, Cam> world_from_moved = world_from_cam * scatter.shift(world_from_cam, frame_seed);
#pragma once

#include <cstdint>
#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "sim/ray_tracer.h"
#include "sim/scene.h"

namespace foresight::sim {

struct ScatterParams {
  double distance_m = 0;  // radius of the ball in which the camera's centre is drawn
  double turn_rad = 0;    // greatest turn, about an axis drawn from all directions
};

class Scatter {
 public:
  /// Builds a ray tracer; keeps no reference.
  Scatter(const Scene& scene, const CameraModel& camera, const ScatterParams& params);

  /// cam_from_moved. Drawn again while something lies between the pose and the moved one, or nearer
  /// than 0.25 m in the middle of its picture; after 20 draws the pose stays where it is. Same
  /// scene, pose and seed: same shift.
  Pose<Cam, Cam> shift(const Pose<World, Cam>& world_from_cam, uint64_t seed) const;

 private:
  bool is_free(const Pose<World, Cam>& world_from_cam,
               const Pose<World, Cam>& world_from_moved) const;

  ScatterParams params_;
  RayTracer tracer_;
  std::vector<Eigen::Vector3d> middle_rays_in_cam_;  // unit length; over the picture's middle half
};

}  // namespace foresight::sim
