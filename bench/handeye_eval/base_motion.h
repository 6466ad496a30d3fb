// Synthetic motions of a robot's base as a tracked camera on its arm would show them: for tests and
// for the comparison of base filters. Seeded; the same seed gives the same numbers.
#pragma once

#include <string>
#include <vector>

#include "procs/calibrator/base_filter.h"

namespace foresight {

enum class BaseMotionKind {
  kStill,
  kRamp,        // at rest, then 0.1 m/s and 10 deg/s, then at rest
  kSine,        // 0.1 m and 5 deg at 0.25 Hz
  kPush,        // 0.2 m and 10 deg within 0.7 s, and back; it sways
  kRandomWalk,  // velocity wanders: 0.1 m/s, 6 deg/s
};
constexpr BaseMotionKind kAllBaseMotions[] = {BaseMotionKind::kStill, BaseMotionKind::kRamp,
                                              BaseMotionKind::kSine, BaseMotionKind::kPush,
                                              BaseMotionKind::kRandomWalk};
const char* to_string(BaseMotionKind kind);

struct BaseMotionOptions {
  double length_s = 20;
  double rate_hz = 30;
  // 3D standard deviations of the camera's pose: from frame to frame, and wandering within a
  // second.
  double noise_m = 0.002, noise_deg = 0.1;
  double wander_m = 0.0007, wander_deg = 0.03;
  double outlier_share = 0.01;  // single frames up to 0.3 m and 20 deg off
  double mistrack_begin_s = 12, mistrack_length_s = 0, mistrack_m = 0.1, mistrack_deg = 5;
  unsigned seed = 1;
};

struct BaseFrame {
  calibration::BaseMeasurement measurement;
  Pose<World, Base> world_from_base;  // the truth
  bool is_wrong = false;              // outlier or mistracked
};

std::vector<BaseFrame> make_base_motion(BaseMotionKind kind, const BaseMotionOptions& options);

}  // namespace foresight
