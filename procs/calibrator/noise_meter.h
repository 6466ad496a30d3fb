// Measures the noise of the camera's pose while it runs: second differences over three frames
// cancel steady motion of the base and leave √6 times the noise of one frame. Slow errors (of the
// map, of the kinematics) are not seen by it.
#pragma once

#include <array>
#include <optional>

#include "procs/calibrator/motion_mixture.h"

namespace foresight::calibration {

class NoiseMeter {
 public:
  /// Starts from an assumed noise (per axis).
  explicit NoiseMeter(const PoseNoise& assumed) : assumed_(assumed), noise_(assumed) {}

  /// `difference`: measured − predicted camera by one and the same base pose, world axes.
  void add(const BaseMeasurement& measurement, const Pose<World, Base>& reference);
  void interrupt() { count_ = 0; }
  const PoseNoise& noise() const { return noise_; }

 private:
  PoseNoise assumed_, noise_;
  std::array<BaseMeasurement, 3> last_;  // newest first
  int count_ = 0;
};

}  // namespace foresight::calibration
