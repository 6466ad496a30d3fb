#include "procs/calibrator/alignment_minimiser.h"

#include <ceres/ceres.h>

#include <array>
#include <memory>

#include "procs/calibrator/geometry.h"

namespace foresight::calibration {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

// Parameter blocks. The cost function gives derivatives by a small step in the leading columns of
// each block, so that the plus-jacobians only have to select them.
using MapBlock = std::array<double, 8>;     // quaternion xyzw, pivot in base, log scale
using CameraBlock = std::array<double, 7>;  // quaternion xyzw, translation
constexpr int kMapSize = 8, kCameraSize = 7, kCameraSteps = 6;

struct Blocks {
  MapBlock map;
  CameraBlock camera;
  double delay_s;
};

Blocks blocks_of(const PivotedEstimate& e) {
  const auto& q = e.rotation.coeffs();
  const auto& c = e.ee_from_cam.rotation().coeffs();
  const Vector3d &t = e.pivot_in_base, &p = e.ee_from_cam.translation();
  return {{q[0], q[1], q[2], q[3], t[0], t[1], t[2], e.log_scale},
          {c[0], c[1], c[2], c[3], p[0], p[1], p[2]},
          e.joint_delay_s};
}

PivotedEstimate estimate_of(const double* map, const double* camera, double delay_s,
                            const Vector3d& pivot_in_map) {
  PivotedEstimate e;
  e.pivot_in_map = pivot_in_map;
  e.rotation = Eigen::Map<const Quaterniond>(map).normalized();
  e.pivot_in_base = Eigen::Map<const Vector3d>(map + 4);
  e.log_scale = map[7];
  e.ee_from_cam = {Quaterniond(Eigen::Map<const Quaterniond>(camera)),
                   Vector3d(Eigen::Map<const Vector3d>(camera + 4))};
  e.joint_delay_s = delay_s;
  return e;
}

// x ⊞ step, by way of PivotedEstimate::moved.
template <int kSize, int kTangent, int kFirstStep>
class StepManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return kSize; }
  int TangentSize() const override { return kTangent; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    static constexpr double kSomeMap[kMapSize] = {0, 0, 0, 1, 0, 0, 0, 0};
    static constexpr double kSomeCamera[kCameraSize] = {0, 0, 0, 1, 0, 0, 0};
    Step step = Step::Zero();
    step.segment<kTangent>(kFirstStep) =
        Eigen::Map<const Eigen::Matrix<double, kTangent, 1>>(delta);
    constexpr bool kIsMap = kFirstStep == 0;
    const PivotedEstimate moved =
        estimate_of(kIsMap ? x : kSomeMap, kIsMap ? kSomeCamera : x, 0, Vector3d::Zero())
            .moved(step);
    const Blocks blocks = blocks_of(moved);
    const double* from = kIsMap ? blocks.map.data() : blocks.camera.data();
    std::copy(from, from + kSize, x_plus_delta);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, kSize, kTangent, Eigen::RowMajor>> j(jacobian);
    j.setZero();
    j.template topRows<kTangent>().setIdentity();
    return true;
  }
  bool Minus(const double*, const double*, double*) const override { return false; }
  bool MinusJacobian(const double*, double*) const override { return false; }
};
using MapManifold = StepManifold<kMapSize, kMapSteps, 0>;
using CameraManifold = StepManifold<kCameraSize, kCameraSteps, kCameraStep>;

class PairCost : public ceres::CostFunction {
 public:
  PairCost(const SampledPair* pair, const CameraModel* camera, const Vector3d& pivot_in_map)
      : pair_(pair), camera_(camera), pivot_in_map_(pivot_in_map) {
    *mutable_parameter_block_sizes() = {kMapSize, kCameraSize, 1};
    set_num_residuals(2 * static_cast<int>(pair->points_in_map.size()));
  }
  bool Evaluate(double const* const* x, double* residuals, double** jacobians) const override {
    const PairResidual r =
        residual_of(*pair_, *camera_, estimate_of(x[0], x[1], *x[2], pivot_in_map_),
                    jacobians == nullptr ? Derivatives::kNone : Derivatives::kAll);
    Eigen::VectorXd::Map(residuals, r.residual.size()) = r.residual;
    if (jacobians == nullptr) return true;
    fill(jacobians[0], kMapSize, r.jacobian.leftCols<kMapSteps>());
    fill(jacobians[1], kCameraSize, r.jacobian.middleCols<kCameraSteps>(kCameraStep));
    fill(jacobians[2], 1, r.jacobian.col(kDelayStep));
    return true;
  }

 private:
  // The block's derivatives, filled up with a column of zeros.
  template <class Columns>
  static void fill(double* out, int size, const Columns& columns) {
    if (out == nullptr) return;
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> j(
        out, columns.rows(), size);
    if (size == 1) {  // Eigen's row-major maps of one column are not assignable from a column
      for (Eigen::Index i = 0; i < columns.rows(); ++i) out[i] = columns(i, 0);
      return;
    }
    j.setZero();
    j.leftCols(columns.cols()) = columns;
  }
  const SampledPair* pair_;
  const CameraModel* camera_;
  Vector3d pivot_in_map_;
};

std::unique_ptr<ceres::LossFunction> make_loss(Loss loss, double loss_px) {
  if (loss == Loss::kHuber) return std::make_unique<ceres::HuberLoss>(loss_px);
  return std::make_unique<ceres::CauchyLoss>(loss_px);
}

ceres::Solver::Options solver_options(const Minimisation& task) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.max_num_iterations = task.max_iterations;
  options.num_threads = 1;
  options.function_tolerance = 1e-8;
  options.parameter_tolerance = 1e-9;
  options.logging_type = ceres::SILENT;
  return options;
}

void bound(const Minimisation& task, ceres::Problem* problem, Blocks* x) {
  if (!task.free.camera) problem->SetParameterBlockConstant(x->camera.data());
  if (task.free.delay) {
    problem->SetParameterLowerBound(&x->delay_s, 0, -task.max_delay_s);
    problem->SetParameterUpperBound(&x->delay_s, 0, task.max_delay_s);
  } else {
    problem->SetParameterBlockConstant(&x->delay_s);
  }
}

}  // namespace

PivotedEstimate minimise(const Minimisation& task, const PivotedEstimate& start) {
  if (task.pairs.empty()) return start;
  Blocks x = blocks_of(start);
  ceres::Problem::Options ownership;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  MapManifold map_manifold;
  CameraManifold camera_manifold;
  const auto loss = make_loss(task.loss, task.loss_px);
  ceres::Problem problem(ownership);
  problem.AddParameterBlock(x.map.data(), kMapSize, &map_manifold);
  problem.AddParameterBlock(x.camera.data(), kCameraSize, &camera_manifold);
  problem.AddParameterBlock(&x.delay_s, 1);
  bound(task, &problem, &x);
  for (const SampledPair* pair : task.pairs) {
    problem.AddResidualBlock(new PairCost(pair, task.camera, start.pivot_in_map), loss.get(),
                             x.map.data(), x.camera.data(), &x.delay_s);
  }
  ceres::Solver::Summary summary;
  ceres::Solve(solver_options(task), &problem, &summary);
  if (!summary.IsSolutionUsable()) return start;
  return estimate_of(x.map.data(), x.camera.data(), x.delay_s, start.pivot_in_map);
}

double loss_weight(Loss loss, double loss_px, double error_px) {
  if (loss == Loss::kHuber) return error_px <= loss_px ? 1 : loss_px / error_px;
  return 1 / (1 + error_px * error_px / (loss_px * loss_px));
}

}  // namespace foresight::calibration
