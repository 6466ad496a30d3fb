#include "procs/calibrator/noise_meter.h"

#include <algorithm>
#include <cmath>

namespace foresight::calibration {
namespace {

constexpr double kMemoryFrames = 60;
constexpr double kLeastShare = 0.2, kMostShare = 4;  // of the assumed noise
constexpr double kClip = 4;                          // standard deviations: outliers count as such
constexpr double kMaxUneven = 0.2;                   // of the time between frames

// Where the camera is beside the place that a base at `reference` would give it.
Vector6d disagreement(const BaseMeasurement& m, const Pose<World, Base>& reference) {
  const Pose<World, Cam> expected = reference * m.base_from_cam;
  Vector6d d;
  d << m.world_from_cam.translation() - expected.translation(),
      vector_from_rotation(m.world_from_cam.rotation() * expected.rotation().conjugate());
  return d;
}

double learn(double noise, double assumed, double squared_noise) {
  const double clipped = std::min(squared_noise, kClip * kClip * noise * noise);
  const double mean = noise * noise + (clipped - noise * noise) / kMemoryFrames;
  return std::clamp(std::sqrt(mean), kLeastShare * assumed, kMostShare * assumed);
}

}  // namespace

void NoiseMeter::add(const BaseMeasurement& measurement, const Pose<World, Base>& reference) {
  last_ = {measurement, last_[0], last_[1]};
  count_ = std::min(count_ + 1, 3);
  if (count_ < 3) return;
  const double step_s = (last_[0].time - last_[1].time).seconds();
  const double before_s = (last_[1].time - last_[2].time).seconds();
  if (std::abs(step_s - before_s) > kMaxUneven * step_s) return;
  const Vector6d second = disagreement(last_[0], reference) -
                          2 * disagreement(last_[1], reference) + disagreement(last_[2], reference);
  const double position2 = second.head<3>().squaredNorm() / 18;  // 6 for the weights, 3 axes
  const double rotation2 = second.tail<3>().squaredNorm() / 18;
  noise_.position_m = learn(noise_.position_m, assumed_.position_m, position2);
  noise_.rotation_rad = learn(noise_.rotation_rad, assumed_.rotation_rad, rotation2);
}

}  // namespace foresight::calibration
