// The camera in the robot's hand: a ray-traced one in a scene that it owns, giving messages.
//
//   CameraRig rig(open_scene(sim_params), params);
//   image_t frame = rig.take(poses_while_open, number);
//
// Used by one thread at a time. Same scene, poses and number: same bytes.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "common/camera_model.h"
#include "common/frames.h"
#include "foresight/image_t.hpp"
#include "sim/ray_camera.h"
#include "sim/robot/params.h"
#include "sim/scene.h"

namespace foresight::sim {

/// The world to look at: "lab" is made from the seed; anything else names a scene file. Throws
/// ConfigError or UnavailableError.
Scene open_scene(const SimParams& params);

struct CameraRigParams {
  RayCameraParams camera;
  int jpeg_quality = 85;
};

class CameraRig {
 public:
  CameraRig(Scene scene, const CameraRigParams& params);

  /// A JPEG of what these poses see together; utime is left to the caller.
  image_t take(std::span<const Pose<World, Cam>> world_from_cam_while_open, int32_t frame_number);
  const CameraModel& model() const { return camera_->model(); }

 private:
  Scene scene_;
  int jpeg_quality_;
  std::unique_ptr<RayCamera> camera_;  // refers to scene_
};

}  // namespace foresight::sim
