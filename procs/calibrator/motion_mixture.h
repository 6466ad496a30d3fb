// An interacting-multiple-model filter for the base: several Kalman filters that differ in how much
// the base is thought to accelerate run side by side, and the measurements decide which to believe.
// A base that stands still is averaged over seconds; one that is pushed is followed at once.
//
// Each model is an error-state filter: position p, rotation R, velocity v, angular velocity ω, all
// in world axes; errors (δp, δθ, δv, δω) with R = exp(δθ) R̂. A frame measures the camera:
//
//   p_cam = p + R c,   R_cam = R R_c     (c, R_c: base_from_cam, by the arm)
//
// so that the noise of the camera's rotation, which moves eq. (8)'s base by the arm's reach, is
// taken for what it is.
#pragma once

#include <Eigen/Core>
#include <array>

#include "procs/calibrator/base_filter.h"
#include "procs/calibrator/geometry.h"

namespace foresight::calibration {

using Vector12d = Eigen::Matrix<double, 12, 1>;
using Matrix12d = Eigen::Matrix<double, 12, 12>;

/// One model's belief.
struct MotionBelief {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d velocity_m_per_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity_rad_per_s = Eigen::Vector3d::Zero();
  Matrix12d covariance = Matrix12d::Zero();

  /// The errors that lead from here to `other`.
  Vector12d error_of(const MotionBelief& other) const;
  void correct(const Vector12d& error);
};

struct MotionModel {
  bool moves = true;  // false: velocity is zero
  // Spectral densities' roots: of the acceleration when it moves, of the velocity when it does not.
  double position_drive;  // m/s/√s, or m/√s
  double rotation_drive;  // rad/s/√s, or rad/√s
};

/// Standard deviations per axis of one measured camera pose.
struct PoseNoise {
  double position_m = 0;
  double rotation_rad = 0;
};

/// What a measurement says against a belief: difference and its covariance.
struct Innovation {
  Vector6d difference;  // measured − predicted: position (m), rotation (rad), world axes
  Matrix6d covariance;
  /// Squared Mahalanobis length; chi² with 6 degrees of freedom when model and measurement agree.
  double distance2() const;
};

class MotionMixture {
 public:
  static constexpr int kModels = 3;  // still, gliding, pushed

  void reset(const Pose<World, Base>& world_from_base, const PoseNoise& noise);
  /// Mixes the models and moves on by dt. Velocities shrink by `velocity_share` on the way.
  void predict(double dt_s, double velocity_share);
  /// Against the model to which the measurement is the least surprising.
  Innovation innovation(const BaseMeasurement& measurement, const PoseNoise& noise) const;
  void update(const BaseMeasurement& measurement, const PoseNoise& noise);

  /// Mean and covariance over the models.
  MotionBelief belief() const;

 private:
  void mix(double dt_s);

  std::array<MotionBelief, kModels> beliefs_;
  std::array<double, kModels> probabilities_{};
};

}  // namespace foresight::calibration
