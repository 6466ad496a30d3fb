// Camera intrinsics: projection with lens distortion, and its inverse.
//
//   auto camera = load_camera_file("camera.yaml");
//   Eigen::Vector2d pixel = camera.project(point_in_cam);
//   Eigen::Vector2d xy = camera.unproject(pixel);          // (x/z, y/z) of the viewing ray
//
// Pixels follow OpenCV: the centre of the first pixel is (0, 0). Lengths are free (m or mu).
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>

namespace foresight {

enum class LensModel {
  kRadtan,       // OpenCV's k1 k2 p1 p2 k3
  kEquidistant,  // OpenCV fisheye: k1…k4 (the fifth coefficient is unused)
};

struct CameraModel {
  LensModel lens = LensModel::kRadtan;
  int width_px = 0;
  int height_px = 0;
  double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;
  std::array<double, 5> distortion{};  // k1 k2 p1 p2 k3, or k1 k2 k3 k4 –

  /// Pixel of a point in front of the camera (z > 0).
  Eigen::Vector2d project(const Eigen::Vector3d& point_in_cam) const {
    return project_normalized(point_in_cam.head<2>() / point_in_cam.z());
  }
  /// Pixel of the viewing ray (x, y, 1).
  Eigen::Vector2d project_normalized(const Eigen::Vector2d& xy) const;
  /// Pixel, and the 2×2 derivative of the pixel by (x, y).
  Eigen::Vector2d project_normalized(const Eigen::Vector2d& xy, Eigen::Matrix2d* jacobian) const;
  /// (x/z, y/z) of the ray through a pixel; fixed-point/Newton iteration, residual < 1e-6 px where
  /// the model is invertible.
  Eigen::Vector2d unproject(const Eigen::Vector2d& pixel) const;

  /// Pixels per unit of (x, y) at a viewing ray, the mean of both directions: the focal length
  /// without distortion, less towards the edges of a wide lens.
  double px_per_xy(const Eigen::Vector2d& xy) const;

  /// Largest |(x, y)| for which the distortion polynomial is monotonic, so that a ray farther out
  /// cannot alias into the image. Cached by prepare(); load_camera_file() and from_message() call
  /// it.
  double max_radius = 1e9;
  void prepare();

  bool in_image(const Eigen::Vector2d& pixel, double margin_px = 0) const {
    return pixel.x() >= margin_px && pixel.y() >= margin_px &&
           pixel.x() <= width_px - 1 - margin_px && pixel.y() <= height_px - 1 - margin_px;
  }
  bool has_distortion() const;
  /// The same camera for an image resized by `factor` (pixel centres kept consistent).
  CameraModel scaled(double factor) const;
  /// The distortion-free pinhole with the same size and matrix.
  CameraModel undistorted() const;
  bool operator==(const CameraModel&) const = default;
};

/// Reads a camera file (YAML: model, width, height, fx, fy, cx, cy, k1, k2, p1, p2, k3; or ROS's,
/// OpenCV's, Kalibr's). Throws ConfigError with file, key, value and limit; procs/camera/README.md.
CameraModel load_camera_file(const std::string& path);

}  // namespace foresight
