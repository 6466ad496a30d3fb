// The mesh on the GPU, and its inverse depth as a pinhole camera sees it. Used for the predicted
// picture and for every texturing view's depth map.
//
//   SurfacePass surface;
//   if (!surface.set_mesh(mesh)) ...                                   // rejected, nothing changed
//   surface.draw(pinhole, cam_from_map);                               // into the bound
//   framebuffer
#pragma once

#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "common/mesh.h"
#include "procs/renderer/gl_objects.h"

namespace foresight {

class SurfacePass {
 public:
  SurfacePass();  // throws GlError
  /// False when an index is out of range, a coordinate is not finite, or ids or
  /// confidences do not match vertices.
  [[nodiscard]] bool set_mesh(const Mesh& mesh);
  /// Clears the bound framebuffer (colour and depth) and draws (1/z, slopes, guess), first row at
  /// the bottom of GL's window, so that texel (0, 0) is pixel (0, 0). `camera` has no distortion.
  /// A guess is what touches the hull or where the vertices' confidence is below the least.
  void draw(const CameraModel& camera, const Pose<Cam, Map>& cam_from_map, double least_confidence);

  int triangles() const { return triangles_; }
  /// Median distance of the measured vertices from their middle: the unit of length of this map.
  double scene_size_mu() const { return scene_size_mu_; }
  /// Up to 256 measured vertices, evenly taken.
  const std::vector<Eigen::Vector3f>& samples_in_map() const { return samples_in_map_; }

 private:
  void measure(const Mesh& mesh);

  GlProgram program_;
  GLint clip_from_map_at_, focal_at_, least_confidence_at_;
  GlVertexArray layout_;
  GlBuffer vertices_, indices_;
  int triangles_ = 0;
  double scene_size_mu_ = 0;
  std::vector<Eigen::Vector3f> samples_in_map_;
};

}  // namespace foresight
