#include "procs/calibrator/motion_mixture.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace foresight::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kModels = MotionMixture::kModels;
constexpr std::array<MotionModel, kModels> kModel{{
    {.moves = false, .position_drive = 0.0003, .rotation_drive = 0.01 * kDegree},
    {.moves = true, .position_drive = 0.05, .rotation_drive = 3 * kDegree},
    {.moves = true, .position_drive = 0.6, .rotation_drive = 40 * kDegree},
}};
// Mean time for which a model goes on to be right, and where it leads to.
constexpr std::array<double, kModels> kDwell_s{4, 2, 0.6};
constexpr double kNext[kModels][kModels] = {{0, 0.5, 0.5}, {0.5, 0, 0.5}, {0.2, 0.8, 0}};
// How fast a base that starts to move may be, for the models that take over from "still".
constexpr double kStartSpeed_m_per_s = 0.05, kStartTurn_rad_per_s = 5 * kDegree;
constexpr double kLeastProbability = 1e-6;

using Cube = std::array<std::array<double, kModels>, kModels>;

Cube transitions(double dt_s) {
  Cube t{};
  for (size_t i = 0; i < kModels; ++i) {
    const double stays = std::exp(-dt_s / kDwell_s[i]);
    for (size_t j = 0; j < kModels; ++j) t[i][j] = i == j ? stays : (1 - stays) * kNext[i][j];
  }
  return t;
}

// Weighted mean of beliefs, around the likeliest, with the spread of the means in the covariance.
MotionBelief mean_of(const std::array<MotionBelief, kModels>& beliefs,
                     const std::array<double, kModels>& weights) {
  const auto likeliest = std::max_element(weights.begin(), weights.end()) - weights.begin();
  MotionBelief mean = beliefs[static_cast<size_t>(likeliest)];
  Vector12d shift = Vector12d::Zero();
  for (size_t i = 0; i < kModels; ++i) shift += weights[i] * mean.error_of(beliefs[i]);
  mean.correct(shift);
  mean.covariance.setZero();
  for (size_t i = 0; i < kModels; ++i) {
    const Vector12d error = mean.error_of(beliefs[i]);
    mean.covariance += weights[i] * (beliefs[i].covariance + error * error.transpose());
  }
  return mean;
}

void hold_still(MotionBelief* b) {
  b->velocity_m_per_s.setZero();
  b->angular_velocity_rad_per_s.setZero();
  b->covariance.rightCols<6>().setZero();
  b->covariance.bottomRows<6>().setZero();
  b->covariance.diagonal().segment<3>(6).setConstant(kStartSpeed_m_per_s * kStartSpeed_m_per_s);
  b->covariance.diagonal().segment<3>(9).setConstant(kStartTurn_rad_per_s * kStartTurn_rad_per_s);
}

void add_drive(const MotionModel& model, double dt_s, MotionBelief* b) {
  for (int i = 0; i < 6; ++i) {
    const double drive = i < 3 ? model.position_drive : model.rotation_drive;
    const double q = drive * drive;
    Matrix12d& p = b->covariance;
    if (!model.moves) {
      p(i, i) += q * dt_s;
      continue;
    }
    p(i, i) += q * dt_s * dt_s * dt_s / 3;
    p(i, i + 6) += q * dt_s * dt_s / 2;
    p(i + 6, i) += q * dt_s * dt_s / 2;
    p(i + 6, i + 6) += q * dt_s;
  }
}

void move_on(const MotionModel& model, double dt_s, double velocity_share, MotionBelief* b) {
  if (model.moves) {
    // Over the step the velocity falls from 1 to velocity_share.
    const double mean_s = 0.5 * (1 + velocity_share) * dt_s;
    b->position_m += mean_s * b->velocity_m_per_s;
    b->rotation =
        (rotation_from_vector(mean_s * b->angular_velocity_rad_per_s) * b->rotation).normalized();
    b->velocity_m_per_s *= velocity_share;
    b->angular_velocity_rad_per_s *= velocity_share;
    Matrix12d f = Matrix12d::Identity();
    f.topRightCorner<6, 6>().diagonal().setConstant(mean_s);
    f.bottomRightCorner<6, 6>().diagonal().setConstant(velocity_share);
    b->covariance = f * b->covariance * f.transpose();
  } else {
    hold_still(b);
  }
  add_drive(model, dt_s, b);
}

using Observation = Eigen::Matrix<double, 6, 12>;

Observation observation_of(const MotionBelief& b, const BaseMeasurement& m) {
  Observation h = Observation::Zero();
  h.topLeftCorner<3, 3>().setIdentity();
  h.block<3, 3>(0, 3) = -skew(b.rotation * m.base_from_cam.translation());
  h.block<3, 3>(3, 3).setIdentity();
  return h;
}

Innovation innovation_of(const MotionBelief& b, const BaseMeasurement& m, const PoseNoise& noise) {
  Innovation i;
  i.difference << m.world_from_cam.translation() - b.position_m -
                      b.rotation * m.base_from_cam.translation(),
      vector_from_rotation(m.world_from_cam.rotation() *
                           (b.rotation * m.base_from_cam.rotation()).conjugate());
  const Observation h = observation_of(b, m);
  i.covariance = h * b.covariance * h.transpose();
  i.covariance.diagonal().head<3>().array() += noise.position_m * noise.position_m;
  i.covariance.diagonal().tail<3>().array() += noise.rotation_rad * noise.rotation_rad;
  return i;
}

void correct_by(const BaseMeasurement& m, const Innovation& i, MotionBelief* b) {
  const Observation h = observation_of(*b, m);
  const Eigen::Matrix<double, 12, 6> gain =
      i.covariance.ldlt().solve(h * b->covariance).transpose();
  b->correct(gain * i.difference);
  b->covariance -= gain * i.covariance * gain.transpose();
  b->covariance = 0.5 * (b->covariance + b->covariance.transpose()).eval();
}

double log_likelihood(const Innovation& i) {
  const Eigen::LDLT<Matrix6d> ldlt(i.covariance);
  return -0.5 * (i.difference.dot(ldlt.solve(i.difference)) + ldlt.vectorD().array().log().sum());
}

}  // namespace

Vector12d MotionBelief::error_of(const MotionBelief& other) const {
  Vector12d e;
  e << other.position_m - position_m, vector_from_rotation(other.rotation * rotation.conjugate()),
      other.velocity_m_per_s - velocity_m_per_s,
      other.angular_velocity_rad_per_s - angular_velocity_rad_per_s;
  return e;
}

void MotionBelief::correct(const Vector12d& e) {
  position_m += e.segment<3>(0);
  rotation = (rotation_from_vector(e.segment<3>(3)) * rotation).normalized();
  velocity_m_per_s += e.segment<3>(6);
  angular_velocity_rad_per_s += e.segment<3>(9);
}

double Innovation::distance2() const { return difference.dot(covariance.ldlt().solve(difference)); }

void MotionMixture::reset(const Pose<World, Base>& world_from_base, const PoseNoise& noise) {
  MotionBelief b;
  b.position_m = world_from_base.translation();
  b.rotation = world_from_base.rotation();
  hold_still(&b);
  b.covariance.diagonal().head<3>().setConstant(noise.position_m * noise.position_m);
  b.covariance.diagonal().segment<3>(3).setConstant(noise.rotation_rad * noise.rotation_rad);
  beliefs_.fill(b);
  probabilities_ = {0.8, 0.1, 0.1};
}

void MotionMixture::mix(double dt_s) {
  const Cube t = transitions(dt_s);
  std::array<MotionBelief, kModels> mixed;
  std::array<double, kModels> probabilities{};
  for (size_t j = 0; j < kModels; ++j) {
    std::array<double, kModels> weights{};
    for (size_t i = 0; i < kModels; ++i) weights[i] = t[i][j] * probabilities_[i];
    for (const double w : weights) probabilities[j] += w;
    for (double& w : weights) w /= probabilities[j];
    mixed[j] = mean_of(beliefs_, weights);
  }
  beliefs_ = mixed;
  probabilities_ = probabilities;
}

void MotionMixture::predict(double dt_s, double velocity_share) {
  mix(dt_s);
  for (size_t i = 0; i < kModels; ++i) move_on(kModel[i], dt_s, velocity_share, &beliefs_[i]);
}

Innovation MotionMixture::innovation(const BaseMeasurement& m, const PoseNoise& noise) const {
  Innovation best = innovation_of(beliefs_[0], m, noise);
  for (size_t i = 1; i < kModels; ++i) {
    const Innovation other = innovation_of(beliefs_[i], m, noise);
    if (other.distance2() < best.distance2()) best = other;
  }
  return best;
}

void MotionMixture::update(const BaseMeasurement& m, const PoseNoise& noise) {
  std::array<double, kModels> logs{};
  for (size_t i = 0; i < kModels; ++i) {
    const Innovation innovation = innovation_of(beliefs_[i], m, noise);
    logs[i] = log_likelihood(innovation);
    correct_by(m, innovation, &beliefs_[i]);
  }
  const double top = *std::max_element(logs.begin(), logs.end());
  double sum = 0;
  for (size_t i = 0; i < kModels; ++i) {
    probabilities_[i] = std::max(kLeastProbability, probabilities_[i] * std::exp(logs[i] - top));
    sum += probabilities_[i];
  }
  for (double& p : probabilities_) p /= sum;
}

MotionBelief MotionMixture::belief() const { return mean_of(beliefs_, probabilities_); }

}  // namespace foresight::calibration
