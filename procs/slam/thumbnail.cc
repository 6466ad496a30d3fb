#include "procs/slam/thumbnail.h"

#include <Eigen/Cholesky>
#include <opencv2/imgproc.hpp>

#include "procs/slam/geometry.h"

namespace foresight::slam {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector4d;

struct NormalEquations {
  Eigen::Matrix4d hessian = Eigen::Matrix4d::Zero();  // turn (3), brightness (1)
  Vector4d gradient = Vector4d::Zero();
  double squared_error = 0;
  int pixels = 0;
  double mean_squared_error() const { return pixels > 0 ? squared_error / pixels : 1e12; }
};

// Bilinear value and slope; false outside.
bool sample(const cv::Mat& image, double x, double y, double* value, Vector2d* slope) {
  if (!(x >= 0) || !(y >= 0) || !(x < image.cols - 1) || !(y < image.rows - 1)) return false;
  const int u = static_cast<int>(x), v = static_cast<int>(y);
  const double fu = x - u, fv = y - v;
  const float* a = image.ptr<float>(v) + u;
  const float* b = image.ptr<float>(v + 1) + u;
  const double top = a[0] + fu * (a[1] - a[0]), bottom = b[0] + fu * (b[1] - b[0]);
  *value = top + fv * (bottom - top);
  *slope = {(1 - fv) * (a[1] - a[0]) + fv * (b[1] - b[0]), bottom - top};
  return true;
}

NormalEquations linearise(const Thumbnail& source, const Thumbnail& target,
                          const CameraModel& camera, const Pose<Cam, Cam>& source_from_target,
                          double depth, double brightness) {
  NormalEquations sums;
  const Eigen::Matrix3d rotation = source_from_target.rotation().toRotationMatrix();
  for (int v = 1; v < target.pixels.rows - 1; ++v) {
    for (int u = 1; u < target.pixels.cols - 1; ++u) {
      const Vector3d ray((u - camera.cx_px) / camera.fx_px, (v - camera.cy_px) / camera.fy_px, 1);
      const Vector3d p = rotation * (depth * ray) + source_from_target.translation();
      if (p.z() < 0.1 * depth) continue;
      const double iz = 1 / p.z();
      double value;
      Vector2d slope;
      if (!sample(source.pixels, camera.fx_px * p.x() * iz + camera.cx_px,
                  camera.fy_px * p.y() * iz + camera.cy_px, &value, &slope)) {
        continue;
      }
      const double residual = value - target.pixels.at<float>(v, u) - brightness;
      const double gx = slope.x() * camera.fx_px * iz, gy = slope.y() * camera.fy_px * iz;
      const Vector3d by_point(gx, gy, -(gx * p.x() + gy * p.y()) * iz);
      // p = R (I + [w]×) depth·ray: the turn acts on the target's side.
      const Vector3d in_target = rotation.transpose() * by_point;
      Vector4d row;
      row << depth * ray.cross(in_target), -1;
      sums.hessian += row * row.transpose();
      sums.gradient += residual * row;
      sums.squared_error += residual * residual;
      ++sums.pixels;
    }
  }
  return sums;
}

}  // namespace

Thumbnail make_thumbnail(const ImagePyramid& pyramid) {
  const cv::Mat& coarsest = pyramid.levels[kLevels - 1];
  cv::Mat half, blurred;
  const cv::Size size(coarsest.cols / 2, coarsest.rows / 2);
  cv::resize(coarsest(cv::Rect(0, 0, 2 * size.width, 2 * size.height)), half, size, 0, 0,
             cv::INTER_AREA);
  half.convertTo(blurred, CV_32F);
  cv::GaussianBlur(blurred, blurred, cv::Size(0, 0), 1.5);
  Thumbnail thumbnail;
  thumbnail.pixels = blurred - cv::mean(blurred);
  return thumbnail;
}

CameraModel thumbnail_camera(const CameraModel& camera) {
  return camera.undistorted().scaled(1.0 / (1 << kLevels));
}

double thumbnail_distance(const Thumbnail& a, const Thumbnail& b) {
  const double norm = cv::norm(a.pixels, b.pixels, cv::NORM_L2);
  return norm * norm / static_cast<double>(a.pixels.total());
}

ThumbnailAlignment align_thumbnails(const Thumbnail& source, const Thumbnail& target,
                                    const CameraModel& camera, const Pose<Cam, Cam>& guess,
                                    double depth) {
  ThumbnailAlignment best;
  best.source_from_target = guess;
  Pose<Cam, Cam> pose = guess;
  double brightness = 0;
  for (int iteration = 0; iteration < 8; ++iteration) {
    const NormalEquations sums = linearise(source, target, camera, pose, depth, brightness);
    const bool enough = 4 * sums.pixels > source.pixels.rows * source.pixels.cols;
    if (iteration == 0) best.initial_error = best.mean_squared_error = sums.mean_squared_error();
    if (!enough || sums.mean_squared_error() > best.mean_squared_error) break;
    best = {pose, sums.mean_squared_error(), best.initial_error};
    const Vector4d step =
        -(sums.hessian + 1e-3 * Eigen::Matrix4d::Identity()).ldlt().solve(sums.gradient);
    if (!step.allFinite() || step.head<3>().norm() > 0.5) break;
    pose =
        Pose<Cam, Cam>(pose.rotation() * rotation_from_vector(step.head<3>()), pose.translation());
    brightness += step(3);
    if (step.head<3>().norm() < 1e-4) break;
  }
  return best;
}

}  // namespace foresight::slam
