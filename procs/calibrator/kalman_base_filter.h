// The base by a mixture of Kalman filters (motion_mixture.h), guarded against mistracking.
//
// A measurement that contradicts the prediction (chi²) is refused and starts, or continues, a
// contender: a filter of its own. Meanwhile the estimate coasts, and the gate stays as wide as it
// was at the first contradiction: were it to grow, a steady wrong pose would soon be inside. The
// contender takes over when it has been consistent for `reacquire_s`; earlier only when it is not
// the first one since (the tracker has jumped again, as it does when it comes back) and lies where
// the base may have gone meanwhile. Frames without a measurement are no contradiction: the base may
// go where it likes unseen, and the gate grows with the doubt.
//
// What is accepted counts at once, but is confirmed only by the next two measurements, when they
// are accepted too, and only while few are refused. When nothing is accepted any more, what is not
// confirmed goes: one forged or mistracked pose would else bend the base for as long as tracking is
// lost.
//
// A belief that has been trusted for kProven_s is proven. Whatever was believed since and is not, a
// contender that agrees with the proven one is believed early: tracking has found back.
#pragma once

#include <deque>
#include <optional>

#include "procs/calibrator/motion_mixture.h"
#include "procs/calibrator/noise_meter.h"

namespace foresight::calibration {

class KalmanBaseFilter : public BaseFilter {
 public:
  explicit KalmanBaseFilter(const BaseFilterOptions& options);

  void reset(const BaseMeasurement& measurement) override;
  BaseState update(const BaseMeasurement& measurement) override;
  BaseState coast(Time time) override;
  std::optional<Pose<World, Base>> earlier() const override;
  BaseFilterStatistics statistics() const override;

 private:
  struct Contender {
    MotionMixture mixture;
    Time begun, time;
    int measurements = 0;
  };
  struct Moment {
    MotionMixture mixture;
    Time time;
  };

  void advance(Time time);
  void confirm();
  void doubt();
  void drop_unconfirmed(Time now);
  bool fits(const BaseMeasurement& measurement);
  void contend(const BaseMeasurement& measurement);
  bool contender_is_believed() const;
  bool contender_returns() const;
  void accept(const BaseMeasurement& measurement);
  BaseState estimate(BaseTracking tracking) const;

  BaseFilterOptions options_;
  NoiseMeter meter_;
  MotionMixture mixture_;
  Time time_;                  // of mixture_
  Time measured_time_;         // of the last accepted measurement
  std::deque<Moment> newest_;  // after the measurements accepted since the last refused one
  int credit_ = 0;             // of the measurements: grows with each, falls with each refused one
  Time credit_begin_;
  std::optional<Moment> confirmed_, proven_;
  bool is_confirmed_ = true;  // nothing was accepted since
  // While measurements are refused:
  std::optional<Matrix6d> gate_;
  std::optional<Contender> contender_;
  int contenders_ = 0;
  BaseFilterStatistics statistics_;
};

}  // namespace foresight::calibration
