#include "procs/renderer/video_renderer.h"

#include <epoxy/gl.h>

#include "procs/renderer/paint_pass.h"

namespace foresight {

struct VideoRenderer::State {
  PaintPass paint_pass;
  CameraModel camera;
  GlTexture image;  // one layer
  GlTexture no_depth;
  int width_px = 0, height_px = 0;
  PictureTarget picture;
  std::vector<uint8_t> scratch;
};

VideoRenderer::VideoRenderer() : state_(std::make_unique<State>()) {
  state_->no_depth = make_texture_array(GL_R32F, 1, 1, 1, GL_NEAREST);
  const float zero = 0;
  glTexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, 1, 1, 1, GL_RED, GL_FLOAT, &zero);
}

VideoRenderer::~VideoRenderer() = default;

InputStatus VideoRenderer::set_image(const CameraModel& camera, const Image& image) {
  State& s = *state_;
  if (!is_sound(camera)) return InputStatus::kBadCamera;
  if (!image.is_valid() || image.width_px != camera.width_px ||
      image.height_px != camera.height_px) {
    return InputStatus::kBadImage;
  }
  if (s.width_px != image.width_px || s.height_px != image.height_px) {
    s.image = make_texture_array(GL_RGBA8, image.width_px, image.height_px, 1, GL_LINEAR);
    s.width_px = image.width_px;
    s.height_px = image.height_px;
  }
  s.camera = camera;
  if (s.camera.max_radius == CameraModel{}.max_radius) s.camera.prepare();
  upload_layer(s.image.name(), 0, image, &s.scratch);
  return InputStatus::kAccepted;
}

RenderStatus VideoRenderer::draw(const CameraModel& camera) {
  State& s = *state_;
  if (!is_sound(camera) || camera.has_distortion()) return RenderStatus::kBadCamera;
  s.picture.bind(camera.width_px, camera.height_px);
  if (s.width_px > 0 && s.camera.undistorted() == s.camera && s.camera == camera) {
    glCopyImageSubData(s.image.name(), GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, s.picture.texture(),
                       GL_TEXTURE_2D, 0, 0, 0, 0, s.width_px, s.height_px, 1);
    return RenderStatus::kDrawn;
  }
  PaintJob job;  // no mesh, the camera's own pose: the image, undistorted
  job.camera = camera;
  job.images = s.image.name();
  job.depths = s.no_depth.name();
  if (s.width_px > 0) {
    PaintView view;
    view.camera = s.camera;
    view.depth_camera = s.camera;
    job.views.push_back(view);
  }
  s.paint_pass.draw(job);
  return RenderStatus::kDrawn;
}

unsigned VideoRenderer::colour() const { return state_->picture.texture(); }

RenderedFrame VideoRenderer::read_back() const {
  RenderedFrame frame;
  state_->picture.read(&frame.rgb, &frame.source);
  return frame;
}

}  // namespace foresight
