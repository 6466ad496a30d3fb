#include "procs/slam/pose_optimizer.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "procs/slam/geometry.h"

namespace foresight::slam {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kBehind = 1e6;
constexpr int kHuberIterations = 5, kTukeyIterations = 7;

double robust_sigma(std::vector<double> errors) {  // of a 2-D error with normal components
  if (errors.empty()) return 0;
  const size_t middle = errors.size() / 2;
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(middle),
                   errors.end());
  return errors[middle] / 1.1774;  // median of the Rayleigh distribution
}

std::vector<double> errors_of(const Pose<Cam, Map>& cam_from_map,
                              const std::vector<PoseObservation>& observations) {
  std::vector<double> errors;
  errors.reserve(observations.size());
  for (const PoseObservation& o : observations) {
    const Vector3d p = cam_from_map * o.point_in_map;
    errors.push_back(p.z() <= 1e-9 ? kBehind : o.scale_px * (p.head<2>() / p.z() - o.xy).norm());
  }
  return errors;
}

double huber_weight(double error, double k) { return error <= k ? 1 : k / error; }

double tukey_weight(double error, double cut) {
  if (error >= cut) return 0;
  const double t = 1 - (error / cut) * (error / cut);
  return t * t;
}

struct NormalEquations {
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
};

NormalEquations linearise(const Pose<Cam, Map>& cam_from_map,
                          const std::vector<PoseObservation>& observations,
                          const std::vector<double>& weights) {
  NormalEquations sums;
  for (size_t i = 0; i < observations.size(); ++i) {
    if (weights[i] <= 0) continue;
    const PoseObservation& o = observations[i];
    const Vector3d p = cam_from_map * o.point_in_map;
    const double iz = 1 / p.z(), x = p.x() * iz, y = p.y() * iz;
    Eigen::Matrix<double, 2, 6> jacobian;
    jacobian << iz, 0, -x * iz, -x * y, 1 + x * x, -y, 0, iz, -y * iz, -1 - y * y, x * y, x;
    jacobian *= o.scale_px;
    const Vector2d residual = o.scale_px * (Vector2d(x, y) - o.xy);
    sums.hessian.noalias() += weights[i] * jacobian.transpose() * jacobian;
    sums.gradient.noalias() += weights[i] * jacobian.transpose() * residual;
  }
  return sums;
}

}  // namespace

PoseEstimate optimize_pose(const Pose<Map, Cam>& start,
                           const std::vector<PoseObservation>& observations) {
  Pose<Cam, Map> cam_from_map = start.inverse();
  PoseEstimate estimate;
  std::vector<double> weights(observations.size());
  for (int i = 0; i < kHuberIterations + kTukeyIterations; ++i) {
    const std::vector<double> errors = errors_of(cam_from_map, observations);
    const double sigma = std::max(robust_sigma(errors), 0.3);
    const bool huber = i < kHuberIterations;
    for (size_t n = 0; n < errors.size(); ++n) {
      weights[n] = errors[n] >= kBehind ? 0
                   : huber              ? huber_weight(errors[n], 1.345 * sigma)
                                        : tukey_weight(errors[n], std::max(2.5, 4.0 * sigma));
    }
    const NormalEquations sums = linearise(cam_from_map, observations, weights);
    const Eigen::LDLT<Matrix6d> solver(sums.hessian +
                                       1e-9 * sums.hessian.trace() / 6 * Matrix6d::Identity());
    const Vector6d step = -solver.solve(sums.gradient);
    if (!step.allFinite()) break;
    cam_from_map = small_motion<Cam>(step) * cam_from_map;
    if (i + 1 == kHuberIterations + kTukeyIterations || (!huber && step.norm() < 1e-7)) {
      estimate.min_information =
          Eigen::SelfAdjointEigenSolver<Matrix6d>(sums.hessian, Eigen::EigenvaluesOnly)
              .eigenvalues()
              .minCoeff();
      break;
    }
    if (huber && step.norm() < 1e-5) i = kHuberIterations - 1;
  }
  estimate.map_from_cam = cam_from_map.inverse();
  estimate.error_px = errors_of(cam_from_map, observations);
  estimate.sigma_px = robust_sigma(estimate.error_px);
  return estimate;
}

}  // namespace foresight::slam
