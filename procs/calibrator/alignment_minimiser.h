// Minimises the robust reprojection objective with Ceres.
#pragma once

#include <vector>

#include "procs/calibrator/alignment_residual.h"

namespace foresight::calibration {

enum class Loss {
  kHuber,   // for pairs that have passed for inliers
  kCauchy,  // forgets gross errors
};

/// Which parts of the estimate may change besides base_from_map.
struct FreeParts {
  bool camera = false;
  bool delay = false;
};

struct Minimisation {
  const CameraModel* camera = nullptr;
  std::vector<const SampledPair*> pairs;
  FreeParts free;
  Loss loss = Loss::kHuber;
  double loss_px = 1;
  double max_delay_s = 0.1;
  int max_iterations = 30;
};

/// From `start` to a minimum; `start` itself when none can be found.
PivotedEstimate minimise(const Minimisation& task, const PivotedEstimate& start);

/// Weight ρ' that a loss gives to a pair with this RMS error.
double loss_weight(Loss loss, double loss_px, double error_px);

}  // namespace foresight::calibration
