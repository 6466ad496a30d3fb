// A mesh as a camera sees it: what surface is behind each pixel, and how far.
//
//   const MeshView mesh(the_mesh);
//   const PixelRays rays(camera, 2);                    // every second pixel of every second row
//   const SeenMesh seen = mesh.from(map_from_cam, rays);
//   seen.depth_mu.at<float>(row, column)
#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "common/camera_model.h"
#include "common/frames.h"
#include "common/mesh.h"
#include "sim/ray_tracer.h"

namespace foresight {

enum class Surface : uint8_t {
  kNone,
  kMeasured,  // all three vertices are map points, and sure enough
  kGuessed,   // one is a corner of the bounding hull, or unsure
};

/// The viewing rays of an image's pixels, in a grid of every `step`th; lens distortion included.
class PixelRays {
 public:
  PixelRays(const CameraModel& camera, int step);
  int step() const { return step_; }
  int rows() const { return rows_; }
  int cols() const { return cols_; }
  /// (x, y, 1): a length along it is a depth.
  const Eigen::Vector3f& ray_in_cam(int row, int col) const {
    return rays_in_cam_[static_cast<size_t>(row * cols_ + col)];
  }

 private:
  int step_, rows_, cols_;
  std::vector<Eigen::Vector3f> rays_in_cam_;
};

/// One entry for each of the rays.
struct SeenMesh {
  cv::Mat depth_mu;  // CV_32F, along the optical axis; 0: no surface
  cv::Mat surface;   // CV_8U, of Surface
  cv::Mat triangle;  // CV_32S, index into the mesh; −1: none
};

class MeshView {
 public:
  /// Which triangles are there for a ray.
  enum class Show {
    kAll,
    kMeasuredFronts,  // those between map points, from the side of free space: looks into rooms
  };
  /// Surface with a vertex below `least_confidence` counts as guessed.
  explicit MeshView(Mesh mesh, double least_confidence = 0, Show show = Show::kAll);

  SeenMesh from(const Pose<Map, Cam>& map_from_cam, const PixelRays& rays) const;
  /// Nothing lies between the two places but what is within 2 % of the way to the second.
  bool is_free(const Eigen::Vector3f& from_in_map, const Eigen::Vector3f& to_in_map) const;
  /// Unit normal, into free space.
  Eigen::Vector3f normal_in_map(int triangle) const;

 private:
  Surface surface(int triangle) const;
  std::optional<sim::RayHit> nearest(const Eigen::Vector3f& from_in_map,
                                     const Eigen::Vector3f& direction) const;

  double least_confidence_;
  Mesh mesh_;
  Show show_;
  sim::RayTracer tracer_;
};

}  // namespace foresight
