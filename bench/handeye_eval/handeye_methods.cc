#include "bench/handeye_eval/handeye_methods.h"

#include <Eigen/QR>
#include <Eigen/SVD>

#include "procs/calibrator/alignment_solver.h"
#include "procs/calibrator/geometry.h"

namespace foresight {
namespace {

using namespace calibration;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kLeastTurn_rad = 5 * kDegree;
constexpr size_t kMaxMotions = 4000;

struct Motion {
  Pose<Ee, Ee> hand;
  Pose<Cam, Cam> camera;
};

std::vector<Motion> motions_of(const HandEyeData& data) {
  std::vector<Motion> motions;
  const size_t n = data.views.size(), stride = 1 + n * n / 2 / kMaxMotions;
  size_t count = 0;
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = i + 1; j < n; ++j) {
      if (++count % stride != 0) continue;
      const HandEyeView &a = data.views[i], &b = data.views[j];
      const Motion m{a.arm.at(0).base_from_ee.inverse() * b.arm.at(0).base_from_ee,
                     a.target_from_cam.inverse() * b.target_from_cam};
      if (vector_from_rotation(m.hand.rotation()).norm() > kLeastTurn_rad) motions.push_back(m);
    }
  }
  return motions;
}

// The map as SLAM might have made it.
const Similarity<Target, Map>& target_from_map() {
  static const Similarity<Target, Map> similarity(0.37, rotation_from_vector({0.4, -1.1, 0.7}),
                                                  Vector3d(0.3, -0.2, 0.5));
  return similarity;
}

}  // namespace

Pose<Ee, Cam> guess_ee_from_cam(const HandEyeData& data) {
  const auto motions = motions_of(data);
  Matrix3d correlation = Matrix3d::Zero();
  for (const Motion& m : motions) {
    correlation += vector_from_rotation(m.hand.rotation()) *
                   vector_from_rotation(m.camera.rotation()).transpose();
  }
  const Eigen::JacobiSVD<Matrix3d> svd(correlation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Matrix3d u = svd.matrixU(), v = svd.matrixV();
  const double sign = (u * v.transpose()).determinant();
  const Matrix3d rotation = u * Vector3d(1, 1, sign).asDiagonal() * v.transpose();
  // (R_hand − I) t − s R t_camera = −t_hand
  const auto rows = static_cast<Eigen::Index>(3 * motions.size());
  Eigen::MatrixXd a(rows, 4);
  Eigen::VectorXd b(rows);
  for (size_t i = 0; i < motions.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(3 * i);
    const Motion& m = motions[i];
    a.block<3, 3>(row, 0) = m.hand.rotation().toRotationMatrix() - Matrix3d::Identity();
    a.block<3, 1>(row, 3) = -rotation * m.camera.translation();
    b.segment<3>(row) = -m.hand.translation();
  }
  const Eigen::VectorXd x = a.colPivHouseholderQr().solve(b);
  return {rotation, Vector3d(x.head<3>())};
}

HandEyeAnswer solve_ours(const HandEyeData& data, AlignmentSolution* solution) {
  AlignmentProblem problem;
  problem.options.refine_camera = true;
  problem.options.estimate_delay = data.is_log;
  problem.options.min_pairs = 6;
  problem.camera = data.camera;
  const Similarity<Map, Target> map_from_target = target_from_map().inverse();
  for (const HandEyeView& v : data.views) {
    problem.pairs.push_back({v.arm.centre, map_from_target * v.target_from_cam, v.arm});
  }
  for (const Vector3d& p : data.points_in_target) {
    problem.points_in_map.push_back((map_from_target * p).cast<float>());
  }
  problem.guess.ee_from_cam = guess_ee_from_cam(data);
  *solution = solve_alignment(problem);
  const AlignmentEstimate& e = solution->estimate;
  const Similarity<Base, Target> base_from_target(
      e.base_from_map.scale() * map_from_target.scale(),
      e.base_from_map.rotation() * map_from_target.rotation(),
      e.base_from_map * map_from_target.translation());
  return {"ours",
          base_from_target,
          e.ee_from_cam,
          e.joint_delay_s,
          true,
          solution->delay_is_estimated,
          solution->reason};
}

}  // namespace foresight
