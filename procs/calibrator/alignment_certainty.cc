#include "procs/calibrator/alignment_certainty.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace foresight::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

struct PairError {
  Vector6d error;  // ε̂: shift (m), turn (rad), camera axes
  PairResidual residual;
  double weight = 1;

  auto a() const { return residual.jacobian.middleCols<6>(kCameraStep); }
};

std::vector<PairError> errors_of(const Minimisation& task, const PivotedEstimate& estimate) {
  std::vector<PairError> errors;
  for (const SampledPair* pair : task.pairs) {
    PairError e;
    e.residual = residual_of(*pair, *task.camera, estimate, Derivatives::kAll);
    const Matrix6d a_t_a = e.a().transpose() * e.a();
    e.error = a_t_a.ldlt().solve(e.a().transpose() * e.residual.residual);
    e.weight = loss_weight(task.loss, task.loss_px, e.residual.residual.norm());
    errors.push_back(e);
  }
  return errors;
}

std::vector<int> free_steps(const FreeParts& free) {
  std::vector<int> steps;
  for (int i = 0; i < kSteps; ++i) {
    const bool is_camera = i >= kCameraStep && i < kDelayStep;
    if ((is_camera && !free.camera) || (i == kDelayStep && !free.delay)) continue;
    steps.push_back(i);
  }
  return steps;
}

// P: second moments over the pairs, corrected for the parameters that were fitted, and a floor.
Matrix6d pair_covariance(const std::vector<PairError>& errors, size_t parameters,
                         const AlignmentOptions& options) {
  Matrix6d sum = Matrix6d::Zero();
  for (const PairError& e : errors) sum += e.weight * e.error * e.error.transpose();
  const double freedom = static_cast<double>(errors.size()) - static_cast<double>(parameters) / 6;
  Matrix6d p = sum / std::max(1.0, freedom);
  const double floor_m2 = options.pose_noise_floor_m * options.pose_noise_floor_m;
  const double floor_rad = options.pose_noise_floor_deg * kDegree;
  p.diagonal().head<3>().array() += floor_m2 / 3;
  p.diagonal().tail<3>().array() += floor_rad * floor_rad / 3;
  return p;
}

// Inverse by eigenvalues of the matrix scaled to a unit diagonal; false when singular.
bool invert(const MatrixXd& h, MatrixXd* inverse) {
  const Eigen::VectorXd diagonal = h.diagonal();
  if (!(diagonal.minCoeff() > 0)) return false;
  const Eigen::VectorXd d = diagonal.cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(d.asDiagonal() * h * d.asDiagonal());
  if (!(eigen.eigenvalues().minCoeff() > 1e-12 * eigen.eigenvalues().maxCoeff())) return false;
  const MatrixXd scaled = eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() *
                          eigen.eigenvectors().transpose();
  *inverse = d.asDiagonal() * scaled * d.asDiagonal();
  return true;
}

double position_sigma_m(const Minimisation& task, const PivotedEstimate& e,
                        const StepMatrix& covariance) {
  double sum = 0;
  for (const SampledPair* pair : task.pairs) {
    const Vector3d arm = std::exp(e.log_scale) *
                         (e.rotation * (pair->pair->map_from_cam.translation() - e.pivot_in_map));
    Eigen::Matrix<double, 3, kMapSteps> by_step;
    by_step << Matrix3d::Identity(), -skew(arm), arm;
    sum +=
        (by_step * covariance.topLeftCorner<kMapSteps, kMapSteps>() * by_step.transpose()).trace();
  }
  return std::sqrt(sum / static_cast<double>(task.pairs.size()));
}

// One step of Gauss–Newton, and the covariance of where it leads.
struct NormalEquations {
  MatrixXd h, m;
  Eigen::VectorXd g;

  explicit NormalEquations(Eigen::Index size)
      : h(MatrixXd::Zero(size, size)),
        m(MatrixXd::Zero(size, size)),
        g(Eigen::VectorXd::Zero(size)) {}
  void add(const MatrixXd& jacobian, const PairError& e, const Matrix6d& p) {
    const MatrixXd j_t_a = jacobian.transpose() * e.a();
    h += e.weight * jacobian.transpose() * jacobian;
    m += e.weight * e.weight * j_t_a * p * j_t_a.transpose();
    g -= e.weight * jacobian.transpose() * e.residual.residual;
  }
  bool solve(Eigen::VectorXd* step, MatrixXd* covariance) const {
    MatrixXd inverse;
    if (!invert(h, &inverse)) return false;
    *step = inverse * g;
    *covariance = inverse * m * inverse;
    return true;
  }
};

}  // namespace

Certainty certainty_of(const Minimisation& task, const PivotedEstimate& estimate,
                       const AlignmentOptions& options) {
  Certainty c;
  c.covariance.setZero();
  const auto errors = errors_of(task, estimate);
  const auto steps = free_steps(task.free);
  if (errors.empty()) return c;
  const Matrix6d p = pair_covariance(errors, steps.size(), options);
  NormalEquations equations(static_cast<Eigen::Index>(steps.size()));
  for (const PairError& e : errors) {
    equations.add(e.residual.jacobian(Eigen::all, steps), e, p);
    c.pair_position_error_m += e.error.head<3>().squaredNorm();
    c.pair_rotation_error_rad += e.error.tail<3>().squaredNorm();
  }
  const auto n = static_cast<double>(errors.size());
  c.pair_position_error_m = std::sqrt(c.pair_position_error_m / n);
  c.pair_rotation_error_rad = std::sqrt(c.pair_rotation_error_rad / n);
  Eigen::VectorXd step;
  MatrixXd covariance;
  if (!equations.solve(&step, &covariance)) return c;
  c.is_determined = true;
  c.covariance(steps, steps) = covariance;
  c.position_sigma_m = position_sigma_m(task, estimate, c.covariance);
  return c;
}

Drift drift_of(const Minimisation& task, const PivotedEstimate& estimate,
               const AlignmentOptions& options) {
  Drift drift;
  const auto errors = errors_of(task, estimate);
  const auto steps = free_steps(task.free);
  if (errors.size() < 2) return drift;
  const Matrix6d p = pair_covariance(errors, steps.size() + 6, options);
  const Time first = task.pairs.front()->pair->time;
  const double span_s = (task.pairs.back()->pair->time - first).seconds();
  if (!(span_s > 0)) return drift;
  const auto n = static_cast<Eigen::Index>(steps.size());
  NormalEquations equations(n + 6);
  for (size_t i = 0; i < errors.size(); ++i) {
    const auto& j = errors[i].residual.jacobian;
    const double share = (task.pairs[i]->pair->time - first).seconds() / span_s - 0.5;
    MatrixXd jacobian(j.rows(), n + 6);
    // Where the base has gone, the map has come from.
    jacobian << j(Eigen::all, steps), -share * j.leftCols<6>();
    equations.add(jacobian, errors[i], p);
  }
  Eigen::VectorXd step;
  MatrixXd covariance;
  drift.is_determined = equations.solve(&step, &covariance);
  if (!drift.is_determined) return drift;
  drift.shift_m = step.segment<3>(n).norm();
  drift.turn_rad = step.segment<3>(n + 3).norm();
  drift.shift_sigma_m = std::sqrt(covariance.block<3, 3>(n, n).trace());
  drift.turn_sigma_rad = std::sqrt(covariance.block<3, 3>(n + 3, n + 3).trace());
  return drift;
}

double second_axis_turn_rad(const std::vector<const SampledPair*>& pairs) {
  if (pairs.empty()) return 0;
  const Eigen::Quaterniond middle =
      pairs[pairs.size() / 2]->pair->arm.at(0).base_from_ee.rotation();
  Matrix3d moments = Matrix3d::Zero();
  Vector3d mean = Vector3d::Zero();
  const auto n = static_cast<double>(pairs.size());
  for (const SampledPair* p : pairs) {
    const Vector3d turn =
        vector_from_rotation(middle.conjugate() * p->pair->arm.at(0).base_from_ee.rotation());
    moments += turn * turn.transpose() / n;
    mean += turn / n;
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(moments - mean * mean.transpose());
  return std::sqrt(std::max(0.0, eigen.eigenvalues()[1]));
}

}  // namespace foresight::calibration
