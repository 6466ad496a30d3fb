#include "bench/handeye_eval/base_filter_evaluation.h"

#include <algorithm>
#include <cmath>

#include "procs/calibrator/geometry.h"

namespace foresight {
namespace {

using calibration::angle_between;
using calibration::kDegree;

constexpr Duration kSettling = seconds(2);
constexpr size_t kAheadFrames = 3;  // 0.1 s at 30 Hz

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// The estimate's error, as a base pose seen from the true one.
Pose<Base, Base> error_of(const BaseFrame& frame, const BaseState& estimate) {
  return frame.world_from_base.inverse() * estimate.world_from_base;
}

void score_errors(const std::vector<BaseFrame>& frames, BaseFilterScore* s) {
  std::vector<double> errors_mm, errors_deg, ahead_mm, jitters_mm, jitters_deg;
  for (size_t i = 1; i < frames.size(); ++i) {
    if (frames[i].measurement.time - frames[0].measurement.time < kSettling) continue;
    const auto error = error_of(frames[i], s->estimates[i]);
    const auto before = error_of(frames[i - 1], s->estimates[i - 1]);
    errors_mm.push_back(1e3 * error.translation().norm());
    errors_deg.push_back(angle_between(error.rotation(), {1, 0, 0, 0}) / kDegree);
    jitters_mm.push_back(1e6 * (error.translation() - before.translation()).squaredNorm());
    jitters_deg.push_back(
        std::pow(angle_between(error.rotation(), before.rotation()) / kDegree, 2));
    if (i + kAheadFrames >= frames.size()) continue;
    const double ahead_s =
        (frames[i + kAheadFrames].measurement.time - frames[i].measurement.time).seconds();
    const Eigen::Vector3d ahead =
        s->estimates[i].world_from_base.translation() + ahead_s * s->estimates[i].velocity_m_per_s;
    ahead_mm.push_back(1e3 *
                       (ahead - frames[i + kAheadFrames].world_from_base.translation()).norm());
  }
  const auto rms = [](const std::vector<double>& squares) {
    double sum = 0;
    for (const double v : squares) sum += v;
    return std::sqrt(sum / static_cast<double>(std::max<size_t>(1, squares.size())));
  };
  s->median_mm = quantile(errors_mm, 0.5);
  s->p95_mm = quantile(errors_mm, 0.95);
  s->max_mm = quantile(errors_mm, 1);
  s->median_deg = quantile(errors_deg, 0.5);
  s->p95_deg = quantile(errors_deg, 0.95);
  s->max_deg = quantile(errors_deg, 1);
  s->ahead_median_mm = quantile(ahead_mm, 0.5);
  s->jitter_mm = rms(jitters_mm);
  s->jitter_deg = rms(jitters_deg);
}

}  // namespace

BaseFilterScore evaluate_base_filter(const std::vector<BaseFrame>& frames,
                                     const calibration::BaseFilterOptions& options) {
  BaseFilterScore s;
  const auto filter = calibration::make_base_filter(options);
  filter->reset(frames.front().measurement);
  for (const BaseFrame& f : frames) s.estimates.push_back(filter->update(f.measurement));
  s.refused = filter->statistics().refused;
  s.reacquisitions = filter->statistics().reacquisitions;
  score_errors(frames, &s);
  return s;
}

}  // namespace foresight
