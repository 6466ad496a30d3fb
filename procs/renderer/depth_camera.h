// The pinhole that draws a texturing view's depth map.
#pragma once

#include "common/camera_model.h"

namespace foresight {

/// Covers what the (distorted) camera sees, up to 76° off axis a side, at `scale` of its size. For
/// a camera without distortion: the same camera, scaled.
CameraModel depth_camera_for(const CameraModel& camera, double scale);

}  // namespace foresight
