#include "procs/calibrator/paper_base_filter.h"

#include <cmath>

#include "procs/calibrator/geometry.h"
#include "procs/calibrator/kalman_base_filter.h"

namespace foresight::calibration {
namespace {

// How fast the base may have moved unseen, for the uncertainty while nothing is measured.
constexpr double kUnseenSpeed_m_per_s = 0.05, kUnseenTurn_rad_per_s = 5 * kDegree;

}  // namespace

void PaperBaseFilter::reset(const BaseMeasurement& measurement) {
  estimate_ = {};
  estimate_.time = measurement.time;
  estimate_.tracking = BaseTracking::kMeasured;
  estimate_.world_from_base = measurement.world_from_base();
  estimate_.position_sigma_m = options_.position_noise_m;
  estimate_.rotation_sigma_rad = options_.rotation_noise_deg * kDegree;
}

BaseState PaperBaseFilter::update(const BaseMeasurement& measurement) {
  const double fresh = 1 - options_.lambda;
  const Pose<World, Base> before = estimate_.world_from_base;
  const Pose<World, Base> now = measurement.world_from_base();
  estimate_.time = measurement.time;
  estimate_.tracking = BaseTracking::kMeasured;
  estimate_.world_from_base = {before.rotation().slerp(fresh, now.rotation()),
                               options_.lambda * before.translation() + fresh * now.translation()};
  const double smoothing = std::sqrt(fresh / (1 + options_.lambda));
  estimate_.position_sigma_m = smoothing * options_.position_noise_m;
  estimate_.rotation_sigma_rad = smoothing * options_.rotation_noise_deg * kDegree;
  return estimate_;
}

BaseState PaperBaseFilter::coast(Time time) {
  const double step_s = (time - estimate_.time).seconds();
  estimate_.time = time;
  estimate_.tracking = BaseTracking::kCoasting;
  estimate_.position_sigma_m += kUnseenSpeed_m_per_s * step_s;
  estimate_.rotation_sigma_rad += kUnseenTurn_rad_per_s * step_s;
  return estimate_;
}

std::unique_ptr<BaseFilter> make_base_filter(const BaseFilterOptions& options) {
  if (options.kind == BaseFilterKind::kPaper) return std::make_unique<PaperBaseFilter>(options);
  return std::make_unique<KalmanBaseFilter>(options);
}

}  // namespace foresight::calibration
