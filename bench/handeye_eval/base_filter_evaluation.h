// Scores a base filter on a synthetic motion.
#pragma once

#include <vector>

#include "bench/handeye_eval/base_motion.h"

namespace foresight {

struct BaseFilterScore {
  // Distance and angle to the truth, after the first two seconds.
  double median_mm = 0, p95_mm = 0, max_mm = 0;
  double median_deg = 0, p95_deg = 0, max_deg = 0;
  // How far off when extrapolated by 0.1 s with the filter's own velocities.
  double ahead_median_mm = 0;
  // Root mean square of the change from frame to frame beyond the true one.
  double jitter_mm = 0, jitter_deg = 0;
  int refused = 0, reacquisitions = 0;
  std::vector<BaseState> estimates;  // one per frame
};

BaseFilterScore evaluate_base_filter(const std::vector<BaseFrame>& frames,
                                     const calibration::BaseFilterOptions& options);

}  // namespace foresight
