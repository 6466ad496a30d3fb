// The paper's filter: B(t) = (1 − λ) B̂(t) + λ B(t − 1), SLERP for the rotation, linear for the
// position, whatever the time between frames. It knows no velocity (publishes zero) and believes
// every measurement: only the tracker's own status keeps mistracking out.
#pragma once

#include "procs/calibrator/base_filter.h"

namespace foresight::calibration {

class PaperBaseFilter : public BaseFilter {
 public:
  explicit PaperBaseFilter(const BaseFilterOptions& options) : options_(options) {}

  void reset(const BaseMeasurement& measurement) override;
  BaseState update(const BaseMeasurement& measurement) override;
  BaseState coast(Time time) override;
  BaseFilterStatistics statistics() const override { return {}; }

 private:
  BaseFilterOptions options_;
  BaseState estimate_;
};

}  // namespace foresight::calibration
