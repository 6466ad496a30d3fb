// The delayed video as it arrives, without lens distortion.
//
//   VideoRenderer video;                                  // needs a current GlContext
//   if (video.set_image(camera, image) == InputStatus::kAccepted) video.draw(camera.undistorted());
//   hud.draw_texture(video.colour(), rectangle, window_height_px);
#pragma once

#include <memory>

#include "common/camera_model.h"
#include "procs/renderer/scene_renderer.h"

namespace foresight {

/// The delayed video without lens distortion, drawn by the shader that paints the scene, so that
/// both pictures match pixel for pixel at the same pose.
class VideoRenderer {
 public:
  VideoRenderer();  // throws GlError
  ~VideoRenderer();
  [[nodiscard]] InputStatus set_image(const CameraModel& camera, const Image& image);
  /// Draws into colour(); before the first image: black. The camera must be free of distortion.
  RenderStatus draw(const CameraModel& camera);
  unsigned colour() const;
  RenderedFrame read_back() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace foresight
