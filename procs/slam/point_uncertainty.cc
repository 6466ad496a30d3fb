#include "procs/slam/point_uncertainty.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace foresight::slam {
namespace {

// A few residuals say little: they are averaged with so many of the usual size.
constexpr double kUsual_px = 0.4;
constexpr double kUsualWeight = 3;

}  // namespace

// Normal matrix H = Σ JᵀJ, J = ∂e/∂X; the variance is σ²/λ_min(H).
double position_sigma(const SlamMap& map, const Point& point) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  double squares = kUsualWeight * kUsual_px * kUsual_px, weight = kUsualWeight;
  for (const Observation& o : point.observations) {
    const Pose<Cam, Map> cam_from_map = map.keyframe(o.keyframe_id)->map_from_cam.inverse();
    const Eigen::Vector3d p = cam_from_map * point.position_in_map;
    if (p.z() <= 0) continue;
    const Eigen::Vector2d xy = p.head<2>() / p.z();
    Eigen::Matrix<double, 2, 3> jacobian;
    jacobian << 1, 0, -xy.x(), 0, 1, -xy.y();
    jacobian *= o.scale_px() / p.z();
    const Eigen::Matrix<double, 2, 3> in_map =
        jacobian * cam_from_map.rotation().toRotationMatrix();
    normal += in_map.transpose() * in_map;
    squares += 0.5 * (o.scale_px() * (xy - o.xy)).squaredNorm();
    weight += 1;
  }
  const Keyframe& source = *map.keyframe(point.source.keyframe_id);
  const double distance = (point.position_in_map - source.map_from_cam.translation()).norm();
  const double weakest =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(normal, Eigen::EigenvaluesOnly)
          .eigenvalues()[0];
  const double sigma_px = std::sqrt(squares / weight);
  return weakest > 0 ? std::min(distance, sigma_px / std::sqrt(weakest)) : distance;
}

}  // namespace foresight::slam
