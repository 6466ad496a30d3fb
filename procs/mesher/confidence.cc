#include "procs/mesher/confidence.h"

#include <cmath>

namespace foresight {

float confidence_of(const VertexEvidence& evidence) {
  constexpr double kDirectionError_rad = 0.002, kHalfSure = 0.05;
  if (evidence.observations < 2 || !(evidence.spread_rad > 0)) return 0;
  const double error =
      kDirectionError_rad / (static_cast<double>(evidence.spread_rad) *
                             std::sqrt(static_cast<double>(evidence.observations)));
  return static_cast<float>(1 / (1 + std::pow(error / kHalfSure, 2)));
}

}  // namespace foresight
