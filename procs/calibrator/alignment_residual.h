// The paper's reprojection objective (after eq. (6)), pair by pair: how far sample points of the
// map lie apart in the image when the camera is placed by the arm and when it is placed by SLAM,
//
//   r_k = Π(K (W⁻¹ E_m T_cam)⁻¹ s X_k) − Π(K E_p⁻¹ X_k)            in undistorted pixels.
//
// K's centre cancels, so only the focal lengths matter. Derivatives are taken by a small step of
// the estimate, in this order:
//   0…2  shift of base_from_map at the pivot (m, base axes)
//   3…5  turn of base_from_map about the pivot (rad, base axes)
//   6    change of log scale
//   7…9  shift of the camera (m, camera axes); 10…12 turn of the camera (rad, camera axes)
//   13   joint delay (s)
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "procs/calibrator/alignment.h"

namespace foresight::calibration {

constexpr int kSteps = 14;
constexpr int kMapSteps = 7, kCameraStep = 7, kDelayStep = 13;
using Step = Eigen::Matrix<double, kSteps, 1>;
using StepMatrix = Eigen::Matrix<double, kSteps, kSteps>;

/// A pair with the points that stand for its scene.
struct SampledPair {
  const PosePair* pair = nullptr;
  std::vector<Eigen::Vector3d> points_in_map;  // mu
  std::vector<Eigen::Vector2d> seen_px;        // their projections by E_p (without K's centre)
  std::vector<double> seen_depth_mu;
};

/// At most `max_points` points in the view of E_p, spread over a 6×4 grid on the image. Empty when
/// fewer than six are in view.
std::optional<SampledPair> sample(const PosePair& pair, const CameraModel& camera,
                                  const std::vector<Eigen::Vector3f>& points_in_map,
                                  int max_points);

/// The estimate with the scale's fixed point: base = translation + s R (map − pivot).
struct PivotedEstimate {
  Eigen::Vector3d pivot_in_map = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d pivot_in_base = Eigen::Vector3d::Zero();
  double log_scale = 0;
  Pose<Ee, Cam> ee_from_cam;
  double joint_delay_s = 0;

  PivotedEstimate() = default;
  PivotedEstimate(const AlignmentEstimate& estimate, const Eigen::Vector3d& pivot_in_map);
  AlignmentEstimate estimate() const;
  PivotedEstimate moved(const Step& step) const;
};

struct PairResidual {
  Eigen::VectorXd residual;                                // 2 per point, px, divided by √points:
                                                           // its norm is the pair's RMS error
  Eigen::Matrix<double, Eigen::Dynamic, kSteps> jacobian;  // empty unless asked for
};

enum class Derivatives { kNone, kAll };

/// A point that comes to lie behind the camera counts as one at a tenth of its depth.
PairResidual residual_of(const SampledPair& pair, const CameraModel& camera,
                         const PivotedEstimate& estimate, Derivatives derivatives);

/// RMS distance of the pair's points, px.
double rms_px(const SampledPair& pair, const CameraModel& camera, const PivotedEstimate& estimate);

}  // namespace foresight::calibration
