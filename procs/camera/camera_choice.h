// Which intrinsics go with which images: one rule for every tool.
#pragma once

#include <string>

#include "common/camera_model.h"
#include "common/image.h"

namespace foresight {

struct ChosenCamera {
  CameraModel camera;       // for images of the size asked for
  bool is_guessed = false;  // focal length 0.9 × the longer side, about 58°
  std::string note;         // where it is from, unless it was named or lies in the folder; scaling
};

/// `camera_file`; if that is empty, camera.yaml in the folder `source` or beside the video
/// `source`; else guessed. A file for another resolution of the same aspect is scaled, one of
/// another aspect is refused (ConfigError).
ChosenCamera choose_camera(const std::string& source, const std::string& camera_file, int width_px,
                           int height_px);

/// What is said of an image that has not the size that the intrinsics are for.
std::string wrong_size(const Image& image, int width_px, int height_px);

}  // namespace foresight
