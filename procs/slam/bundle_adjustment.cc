#include "procs/slam/bundle_adjustment.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "common/pose_alignment.h"
#include "procs/slam/geometry.h"

namespace foresight::slam {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// With the right focal length the factor came out within 0.03 of 1, the cost ratio at 0.98 to 1;
// with one that is 20 % off, 0.14 and more away, at cost ratios of 0.3 to 0.72; a map too small to
// tell gave 0.84 at 0.94.
constexpr double kFocalTolerance = 0.05, kFocalEvidence = 0.8;  // factor off by, cost ratio below

using PoseBlock = std::array<double, 7>;  // cam_from_map: quaternion xyzw, translation
using PoseBlocks = IdVector<BundleKeyframeIndex, PoseBlock>;
using PointBlocks = IdVector<BundlePointIndex, Vector3d>;

// Left multiplication with a small motion. The cost functions give derivatives by that motion in
// the first six of seven columns, so that the plus-jacobian only has to select them.
class PoseManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const Eigen::Map<const Eigen::Quaterniond> q(x);
    const Eigen::Map<const Vector3d> t(x + 4), v(delta), w(delta + 3);
    const Eigen::Quaterniond turn = rotation_from_vector(w);
    Eigen::Map<Eigen::Quaterniond> new_q(x_plus_delta);
    Eigen::Map<Vector3d> new_t(x_plus_delta + 4);
    const Vector3d moved = turn * t + v;
    new_q = (turn * q).normalized();
    new_t = moved;
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>> j(jacobian);
    j.setZero();
    j.topRows<6>().setIdentity();
    return true;
  }
  bool Minus(const double*, const double*, double*) const override { return false; }
  bool MinusJacobian(const double*, double*) const override { return false; }
};

// scale_px · (factor · π(R X + t) − xy), and its derivatives; the last by the factor.
struct Reprojection {
  Vector2d residual;
  Eigen::Matrix<double, 2, 7, Eigen::RowMajor> by_pose;
  Eigen::Matrix<double, 2, 3, Eigen::RowMajor> by_point;
  Vector2d by_factor;
};

bool reproject(const BundleObservation& o, const double* pose, const double* point_in_map,
               double factor, bool derivatives, Reprojection* out) {
  const Eigen::Map<const Eigen::Quaterniond> q(pose);
  const Eigen::Map<const Vector3d> t(pose + 4), point(point_in_map);
  const Eigen::Matrix3d rotation = q.toRotationMatrix();
  const Vector3d p = rotation * point + t;
  if (p.z() < 1e-6) return false;
  const double iz = 1 / p.z(), x = p.x() * iz, y = p.y() * iz;
  out->residual = o.scale_px * (factor * Vector2d(x, y) - o.xy);
  if (!derivatives) return true;
  Eigen::Matrix<double, 2, 3> by_p;
  by_p << iz, 0, -x * iz, 0, iz, -y * iz;
  by_p *= factor * o.scale_px;
  out->by_pose << by_p, -by_p * skew(p), Vector2d::Zero();
  out->by_point = by_p * rotation;
  out->by_factor = o.scale_px * Vector2d(x, y);
  return true;
}

// To where the solver wants it.
void write(const Reprojection& r, double* residuals, double** jacobians) {
  Eigen::Map<Vector2d>(residuals, 2) = r.residual;
  if (jacobians == nullptr) return;
  if (jacobians[0] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, 7, Eigen::RowMajor>>(jacobians[0], 2, 7) = r.by_pose;
  }
  if (jacobians[1] != nullptr) {
    Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>>(jacobians[1], 2, 3) = r.by_point;
  }
}

class ReprojectionCost : public ceres::SizedCostFunction<2, 7, 3> {
 public:
  explicit ReprojectionCost(const BundleObservation& o) : observation_(o) {}

  // A false answer makes the solver reject the step.
  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Reprojection r;
    if (!reproject(observation_, parameters[0], parameters[1], 1, jacobians != nullptr, &r)) {
      return false;
    }
    write(r, residuals, jacobians);
    return true;
  }

 private:
  BundleObservation observation_;
};

class FocalReprojectionCost : public ceres::SizedCostFunction<2, 7, 3, 1> {
 public:
  explicit FocalReprojectionCost(const BundleObservation& o) : observation_(o) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    Reprojection r;
    if (!reproject(observation_, parameters[0], parameters[1], parameters[2][0],
                   jacobians != nullptr, &r)) {
      return false;
    }
    write(r, residuals, jacobians);
    if (jacobians != nullptr && jacobians[2] != nullptr)
      Eigen::Map<Vector2d>(jacobians[2], 2) = r.by_factor;
    return true;
  }

 private:
  BundleObservation observation_;
};

PoseBlock block_from_pose(const Pose<Map, Cam>& map_from_cam) {
  const Pose<Cam, Map> p = map_from_cam.inverse();
  const Eigen::Quaterniond& q = p.rotation();
  const Vector3d& t = p.translation();
  return {q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()};
}

Pose<Map, Cam> pose_from_block(const PoseBlock& b) {
  return Pose<Cam, Map>(Eigen::Quaterniond(b[3], b[0], b[1], b[2]), Vector3d(b[4], b[5], b[6]))
      .inverse();
}

ceres::Solver::Options solver_options(const BundleProblem& problem) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = problem.max_iterations;
  options.num_threads = 1;
  options.function_tolerance = 1e-6;
  options.parameter_tolerance = 1e-8;
  options.logging_type = ceres::SILENT;
  return options;
}

// `factor` of the focal length: adjusted if given. The final robust cost goes to `cost`.
bool solve(const BundleProblem& problem, PoseBlocks* poses, PointBlocks* points, double* factor,
           double* cost) {
  ceres::Problem::Options ownership;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  PoseManifold manifold;
  ceres::HuberLoss loss(problem.huber_px);
  ceres::Problem ceres_problem(ownership);
  auto* ordering = new ceres::ParameterBlockOrdering;  // owned by the options below
  ceres::Solver::Options options = solver_options(problem);
  options.linear_solver_ordering.reset(ordering);
  for (const BundleKeyframeIndex i : poses->ids()) {
    double* block = (*poses)[i].data();
    ceres_problem.AddParameterBlock(block, 7, &manifold);
    ordering->AddElementToGroup(block, 1);
    if (problem.keyframes[i].role == BundleRole::kFixed) {
      ceres_problem.SetParameterBlockConstant(block);
    }
  }
  for (Vector3d& point : *points) {
    ceres_problem.AddParameterBlock(point.data(), 3);
    ordering->AddElementToGroup(point.data(), 0);
  }
  if (factor != nullptr) {
    ceres_problem.AddParameterBlock(factor, 1);
    ordering->AddElementToGroup(factor, 1);
  }
  Reprojection seen;
  for (const BundleObservation& o : problem.observations) {
    double* pose = (*poses)[o.keyframe].data();
    double* point = (*points)[o.point].data();
    if (!reproject(o, pose, point, 1, false, &seen)) continue;  // behind: judged an outlier
    if (factor != nullptr) {
      ceres_problem.AddResidualBlock(new FocalReprojectionCost(o), &loss, pose, point, factor);
    } else {
      ceres_problem.AddResidualBlock(new ReprojectionCost(o), &loss, pose, point);
    }
  }
  ceres::Solver::Summary summary;
  ceres::Solve(options, &ceres_problem, &summary);
  *cost = summary.final_cost;
  return summary.IsSolutionUsable();
}

void judge_observations(const BundleProblem& problem, BundleSolution* solution) {
  double squared_sum = 0;
  size_t inliers = 0;
  solution->fits.resize(problem.points.size());
  IdVector<BundleKeyframeIndex, Pose<Cam, Map>> cam_from_map;
  for (const BundleKeyframe& k : solution->keyframes) {
    cam_from_map.push_back(k.map_from_cam.inverse());
  }
  for (const BundleObservation& o : problem.observations) {
    const Vector3d p = cam_from_map[o.keyframe] * solution->points[o.point].position_in_map;
    const double error = p.z() > 0 ? o.scale_px * (p.head<2>() / p.z() - o.xy).norm() : 1e6;
    if (error > problem.outlier_px) {
      solution->outliers.push_back(o);
    } else {
      squared_sum += error * error;
      ++inliers;
      BundleSolution::Fit& fit = solution->fits[o.point];
      ++fit.observations;
      fit.rms_px += error * error;  // a sum, until below
    }
  }
  for (BundleSolution::Fit& fit : solution->fits) {
    fit.rms_px = std::sqrt(fit.rms_px / std::max(1, fit.observations));
  }
  solution->rms_px = inliers > 0 ? std::sqrt(squared_sum / static_cast<double>(inliers)) : 0;
}

// Moves the solution by the similarity that brings its keyframes closest to where they were.
void bring_back(const BundleProblem& problem, BundleSolution* solution) {
  std::vector<Pose<Map, Cam>> before, after;
  for (const BundleKeyframe& k : problem.keyframes) before.push_back(k.map_from_cam);
  for (const BundleKeyframe& k : solution->keyframes) after.push_back(k.map_from_cam);
  const auto back = align_poses(before, after);
  if (!back) return;
  for (BundleKeyframe& k : solution->keyframes) k.map_from_cam = *back * k.map_from_cam;
  for (BundlePoint& p : solution->points) p.position_in_map = *back * p.position_in_map;
}

}  // namespace

BundleSolution adjust_bundle(const BundleProblem& problem) {
  PoseBlocks poses;
  PointBlocks points;
  for (const BundleKeyframe& k : problem.keyframes)
    poses.push_back(block_from_pose(k.map_from_cam));
  for (const BundlePoint& p : problem.points) points.push_back(p.position_in_map);

  BundleSolution solution;
  solution.keyframes = problem.keyframes;
  solution.points = problem.points;
  double cost;
  solution.usable =
      !problem.observations.empty() && solve(problem, &poses, &points, nullptr, &cost);
  if (!solution.usable) return solution;
  for (const BundleKeyframeIndex i : poses.ids()) {
    if (problem.keyframes[i].role == BundleRole::kAdjusted) {
      solution.keyframes[i].map_from_cam = pose_from_block(poses[i]);
    }
  }
  for (const BundlePointIndex i : points.ids()) {
    solution.points[i].position_in_map = points[i];
    solution.usable = solution.usable && points[i].allFinite();
  }
  if (problem.floats && solution.usable) bring_back(problem, &solution);
  judge_observations(problem, &solution);
  return solution;
}

FocalCheck check_focal_length(BundleProblem problem) {
  FocalCheck check;
  if (problem.observations.empty()) return check;
  PoseBlocks poses;
  PointBlocks points;
  for (const BundleKeyframe& k : problem.keyframes) {
    poses.push_back(block_from_pose(k.map_from_cam));
  }
  for (const BundlePoint& p : problem.points) points.push_back(p.position_in_map);
  double given_cost, best_cost;
  check.usable = solve(problem, &poses, &points, nullptr, &given_cost) &&
                 solve(problem, &poses, &points, &check.factor, &best_cost) && given_cost > 0;
  if (check.usable) check.cost_ratio = best_cost / given_cost;
  return check;
}

bool FocalCheck::contradicts() const {
  return std::abs(factor - 1) > kFocalTolerance && cost_ratio < kFocalEvidence;
}

}  // namespace foresight::slam
