// The simulated world as whoever may know the truth sees it.
#pragma once

#include <opencv2/core.hpp>

#include "common/camera_model.h"
#include "common/frames.h"
#include "sim/ray_camera.h"
#include "sim/robot/params.h"
#include "sim/scene.h"

namespace foresight {

class TrueView {
 public:
  /// `params`: those of sim. Takes a second to build the lab. Throws StartupError.
  TrueView(const sim::SimParams& params, const CameraModel& camera);

  /// What a noiseless, distortion-free camera sees, RGB.
  cv::Mat picture(const Pose<World, Cam>& world_from_cam);
  /// Median over the picture of how far the surface that is seen from the true pose moves in the
  /// picture when it is drawn from another pose.
  double shift_px(const Pose<World, Cam>& truth, const Pose<World, Cam>& other) const;

 private:
  sim::Scene scene_;
  CameraModel camera_;
  sim::RayCamera pictures_;
  CameraModel coarse_camera_;  // of the depths: 16 pixels wide
  sim::RayCamera depths_;
};

}  // namespace foresight
