// An image sequence in TUM RGB-D layout: rgb.txt, camera.yaml, groundtruth.txt.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "common/pose_track.h"
#include "common/time.h"

namespace foresight {

struct SequenceImage {
  Time time;
  std::string path;
};

struct Sequence {
  std::string name;
  CameraModel camera;
  std::vector<SequenceImage> images;
  std::vector<SequenceImage> depth_images;  // may be empty
  std::vector<TimedPose> truth;             // may be empty
  /// Metres per unit of the depth images; 0 if there are none. TUM's default is 1/5000.
  double depth_scale = 0;
  /// What took the depth images, if they are not registered to the colour images (camera.yaml then
  /// has a depth_fx of their own); load_depth() registers them.
  std::optional<CameraModel> depth_camera;

  /// Interpolated; empty outside the truth or in a gap of more than 0.1 s.
  std::optional<Pose<World, Cam>> truth_at(Time time) const;
};

/// Throws StartupError with one line that names the file.
Sequence load_sequence(const std::string& folder);

}  // namespace foresight
