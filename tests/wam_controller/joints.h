// Small helpers of the controller's tests.
#pragma once

#include <initializer_list>
#include <string>

#include "common/arm_model.h"

namespace foresight {

inline const std::string kArms = FORESIGHT_ARMS;

inline JointVector joints(std::initializer_list<double> values) {
  JointVector v(static_cast<Eigen::Index>(values.size()));
  Eigen::Index i = 0;
  for (const double value : values) v[i++] = value;
  return v;
}

}  // namespace foresight
