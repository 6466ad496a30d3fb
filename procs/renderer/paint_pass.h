// Full-screen passes that paint a picture from images: each pixel takes the first texturing view
// that sees its surface well (docs/algorithms/rendering.md, steps 4 to 6).
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "common/image.h"
#include "procs/renderer/gl_objects.h"
#include "procs/renderer/shaders.h"

namespace foresight {

/// A texturing view as the shader sees it.
struct PaintView {
  Eigen::Matrix3d view_from_pred_rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d view_from_pred_translation = Eigen::Vector3d::Zero();
  CameraModel camera;
  CameraModel depth_camera;
  int layer = 0;
};

struct PaintJob {
  CameraModel camera;               // of the picture; no distortion
  std::optional<unsigned> surface;  // texture of SurfacePass; none: there is no mesh
  unsigned images = 0;              // texture array, RGBA8
  unsigned depths = 0;              // texture array, R32F
  bool paint_hull = true;
  bool paint_background = true;
  std::vector<PaintView> views;  // by rank, at most kMaxUsedViews, one lens kind
};

ShaderLens shader_lens(const CameraModel& camera);
/// Size, focal lengths and coefficients are finite and within limits.
bool is_sound(const CameraModel& camera);

class PaintPass {
 public:
  PaintPass();
  ~PaintPass();
  /// Draws into the bound framebuffer, which needs a depth buffer: it marks the pixels that the
  /// newest view paints well, so that the search through all views runs on the others only.
  /// Compiles shaders at the first use of a lens kind.
  void draw(const PaintJob& job);

 private:
  struct Program;
  const Program& program(const PaintShader& variant);
  void run(const PaintShader& variant, const PaintJob& job);

  std::map<PaintShader, Program> programs_;
  GlVertexArray no_vertices_;
  GlBuffer views_;
};

/// A picture with its framebuffer.
class PictureTarget {
 public:
  /// Binds the framebuffer; a changed size makes a new texture.
  void bind(int width_px, int height_px);
  unsigned texture() const { return colour_.name(); }
  int width_px() const { return width_px_; }
  int height_px() const { return height_px_; }
  /// RGB and the source codes of alpha. Empty before the first bind().
  void read(Image* rgb, std::vector<uint8_t>* source) const;

 private:
  int width_px_ = 0, height_px_ = 0;
  GlTexture colour_;
  GlRenderbuffer depth_;
  GlFramebuffer framebuffer_;
};

/// Uploads an image to a layer of an RGBA8 texture array; gray becomes RGB.
void upload_layer(unsigned texture_array, int layer, const Image& image,
                  std::vector<uint8_t>* scratch);

}  // namespace foresight
