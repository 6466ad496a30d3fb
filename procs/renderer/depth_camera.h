// The pinhole that draws a texturing view's depth map.
#pragma once

#include "common/camera_model.h"

namespace foresight {

/// A pinhole of the given size that covers what the (distorted) camera sees, up to 76° off axis a
/// side. For a camera without distortion: the same camera, resized.
CameraModel depth_camera_for(const CameraModel& camera, int width_px, int height_px);

struct DepthMapSize {
  int width_px = 0, height_px = 0;
};
/// `scale` times the camera's focal length in texels, at most the image's own size. A wide lens
/// needs more texels than scale · image, because a pinhole spends most of them on the rim.
DepthMapSize depth_map_size(const CameraModel& camera, double scale);

}  // namespace foresight
