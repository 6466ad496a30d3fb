#include "common/camera_model.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace foresight {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

Vector2d distort_radtan(const std::array<double, 5>& k, const Vector2d& p, Matrix2d* jacobian) {
  const auto [k1, k2, p1, p2, k3] = k;
  const double x = p.x(), y = p.y();
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  if (jacobian != nullptr) {
    const double d_radial = k1 + r2 * (2 * k2 + r2 * 3 * k3);  // by r²
    (*jacobian)(0, 0) = radial + 2 * x * x * d_radial + 2 * p1 * y + 6 * p2 * x;
    (*jacobian)(0, 1) = 2 * x * y * d_radial + 2 * p1 * x + 2 * p2 * y;
    (*jacobian)(1, 0) = 2 * x * y * d_radial + 2 * p1 * x + 2 * p2 * y;
    (*jacobian)(1, 1) = radial + 2 * y * y * d_radial + 6 * p1 * y + 2 * p2 * x;
  }
  return {x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x),
          y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
}

Vector2d distort_equidistant(const std::array<double, 5>& k, const Vector2d& p,
                             Matrix2d* jacobian) {
  const double r = p.norm();
  if (r < 1e-9) {
    if (jacobian != nullptr) jacobian->setIdentity();
    return p;
  }
  const double theta = std::atan(r), t2 = theta * theta;
  const double theta_d = theta * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
  const double scale = theta_d / r;
  if (jacobian != nullptr) {
    const double d_theta = 1 + t2 * (3 * k[0] + t2 * (5 * k[1] + t2 * (7 * k[2] + t2 * 9 * k[3])));
    const double d_r = d_theta / (1 + r * r);  // of theta_d by r
    const Vector2d u = p / r;
    *jacobian = scale * Matrix2d::Identity() + (d_r - scale) * u * u.transpose();
  }
  return scale * p;
}

}  // namespace

Vector2d CameraModel::project_normalized(const Vector2d& xy, Matrix2d* jacobian) const {
  Vector2d d = xy;
  if (has_distortion()) {
    d = lens == LensModel::kRadtan ? distort_radtan(distortion, xy, jacobian)
                                   : distort_equidistant(distortion, xy, jacobian);
  } else if (jacobian != nullptr) {
    jacobian->setIdentity();
  }
  if (jacobian != nullptr) {
    jacobian->row(0) *= fx_px;
    jacobian->row(1) *= fy_px;
  }
  return {fx_px * d.x() + cx_px, fy_px * d.y() + cy_px};
}

Vector2d CameraModel::project_normalized(const Vector2d& xy) const {
  return project_normalized(xy, nullptr);
}

Vector2d CameraModel::unproject(const Vector2d& pixel) const {
  Vector2d xy((pixel.x() - cx_px) / fx_px, (pixel.y() - cy_px) / fy_px);
  if (!has_distortion()) return xy;
  Matrix2d jacobian;
  for (int i = 0; i < 20; ++i) {  // Newton on project(xy) = pixel
    const Vector2d error = project_normalized(xy, &jacobian) - pixel;
    if (error.squaredNorm() < 1e-14) break;
    xy -= jacobian.inverse() * error;
    if (const double r = xy.norm(); r > max_radius) xy *= max_radius / r;
  }
  return xy;
}

double CameraModel::px_per_xy(const Vector2d& xy) const {
  if (!has_distortion()) return std::sqrt(fx_px * fy_px);
  Matrix2d jacobian;
  (void)project_normalized(xy, &jacobian);
  return std::sqrt(std::abs(jacobian.determinant()));
}

bool CameraModel::has_distortion() const {
  return lens == LensModel::kEquidistant ||
         std::any_of(distortion.begin(), distortion.end(), [](double k) { return k != 0; });
}

void CameraModel::prepare() {
  max_radius = lens == LensModel::kEquidistant ? 50.0 : 10.0;
  if (!has_distortion()) return;
  double last = 0;
  for (double r = 0.005; r < max_radius; r += 0.005) {
    const Vector2d p(r, 0);
    const double d =
        lens == LensModel::kRadtan
            ? r * (1 + r * r * (distortion[0] + r * r * (distortion[1] + r * r * distortion[4])))
            : distort_equidistant(distortion, p, nullptr).x();
    if (d <= last) {
      max_radius = r - 0.01;
      break;
    }
    last = d;
  }
}

CameraModel CameraModel::scaled(double factor) const {
  CameraModel s = *this;
  s.width_px = static_cast<int>(std::lround(width_px * factor));
  s.height_px = static_cast<int>(std::lround(height_px * factor));
  s.fx_px = fx_px * factor;
  s.fy_px = fy_px * factor;
  s.cx_px = (cx_px + 0.5) * factor - 0.5;
  s.cy_px = (cy_px + 0.5) * factor - 0.5;
  return s;
}

CameraModel CameraModel::undistorted() const {
  CameraModel s = *this;
  s.lens = LensModel::kRadtan;
  s.distortion.fill(0);
  s.prepare();
  return s;
}

}  // namespace foresight
