#include "procs/calibrator/kalman_base_filter.h"

#include <algorithm>
#include <cmath>

namespace foresight::calibration {
namespace {

constexpr double kGate = 27.9;     // chi², 6 degrees of freedom: 1 in 10 000 right ones is refused
constexpr double kReturn_s = 0.3;  // consistency asked of a tracker that comes back
constexpr double kMaxStep_s = 0.1;  // longer spans are predicted in steps
// Measurements that confirm must be trusted: one refused costs as much as several accepted give.
constexpr int kEnoughCredit = 5, kMostCredit = 15, kLostCredit = 5;
constexpr double kCreditTime_s = 0.3;
constexpr size_t kConfirming = 2;   // measurements
constexpr double kSilence_s = 0.3;  // after which what is not confirmed is forgotten
constexpr double kMovesOn_s = 0.4;  // with the confirmed velocity

constexpr double kProven_s = 2;
constexpr double kSamePlace_m = 0.03, kSameTurn_rad = 2 * kDegree;

bool is_same_place(const MotionBelief& a, const MotionBelief& b) {
  return (a.position_m - b.position_m).norm() < kSamePlace_m &&
         angle_between(a.rotation, b.rotation) < kSameTurn_rad;
}

PoseNoise assumed_noise(const BaseFilterOptions& options) {
  return {options.position_noise_m / std::sqrt(3.0),
          options.rotation_noise_deg * kDegree / std::sqrt(3.0)};
}

}  // namespace

KalmanBaseFilter::KalmanBaseFilter(const BaseFilterOptions& options)
    : options_(options), meter_(assumed_noise(options)) {}

void KalmanBaseFilter::reset(const BaseMeasurement& measurement) {
  mixture_.reset(measurement.world_from_base(), assumed_noise(options_));
  time_ = measured_time_ = measurement.time;
  newest_.clear();
  credit_ = 0;
  confirmed_.reset();
  proven_.reset();
  is_confirmed_ = true;
  meter_ = NoiseMeter(assumed_noise(options_));
  gate_.reset();
  contender_.reset();
  contenders_ = 0;
}

void KalmanBaseFilter::advance(Time time) {
  while (time_ < time) {
    const double step_s = std::min(kMaxStep_s, (time - time_).seconds());
    // While frames are measured the velocity lives on; without them it dies away.
    const bool is_blind = (time - measured_time_).seconds() > kMaxStep_s;
    mixture_.predict(step_s, is_blind ? std::exp(-step_s / options_.velocity_decay_s) : 1);
    time_ = time_ + seconds(step_s);
  }
}

void KalmanBaseFilter::confirm() {
  is_confirmed_ = false;
  if (credit_ == 0) credit_begin_ = time_;
  credit_ = std::min(credit_ + 1, kMostCredit);
  newest_.push_back({mixture_, time_});
  if (newest_.size() <= kConfirming) return;
  if (newest_.size() > kConfirming + 1) newest_.pop_front();
  const double trusted_s = (time_ - credit_begin_).seconds();
  if (credit_ < kEnoughCredit || trusted_s < kCreditTime_s) return;
  confirmed_ = newest_.front();
  if (trusted_s >= kProven_s) proven_ = confirmed_;
}

void KalmanBaseFilter::doubt() {
  credit_ = std::max(0, credit_ - kLostCredit);
  newest_.clear();
}

// The gate stays as wide as it was, and whoever contends goes on.
void KalmanBaseFilter::drop_unconfirmed(Time now) {
  if (is_confirmed_ || !confirmed_) return;
  if ((now - measured_time_).seconds() <= kSilence_s) return;
  newest_.clear();
  credit_ = 0;
  is_confirmed_ = true;
  mixture_ = confirmed_->mixture;
  time_ = confirmed_->time;
  // A base that moved has moved on, but not for as long as forged poses may have come.
  measured_time_ = std::min(measured_time_, time_ + seconds(kMovesOn_s));
  advance(measured_time_ + seconds(kMaxStep_s));
}

bool KalmanBaseFilter::fits(const BaseMeasurement& measurement) {
  Innovation innovation = mixture_.innovation(measurement, meter_.noise());
  if (gate_) innovation.covariance = *gate_;
  return innovation.distance2() < kGate;
}

void KalmanBaseFilter::accept(const BaseMeasurement& measurement) {
  mixture_.update(measurement, meter_.noise());
  measured_time_ = measurement.time;
  confirm();
  gate_.reset();
  contender_.reset();
  contenders_ = 0;
}

void KalmanBaseFilter::contend(const BaseMeasurement& measurement) {
  ++statistics_.refused;
  doubt();
  const PoseNoise& noise = meter_.noise();
  if (!gate_) gate_ = mixture_.innovation(measurement, noise).covariance;
  if (contender_) {
    contender_->mixture.predict((measurement.time - contender_->time).seconds(), 1);
    contender_->time = measurement.time;
    if (contender_->mixture.innovation(measurement, noise).distance2() < kGate) {
      contender_->mixture.update(measurement, noise);
      ++contender_->measurements;
      return;
    }
  }
  contender_ = {{}, measurement.time, measurement.time, 1};
  contender_->mixture.reset(measurement.world_from_base(), assumed_noise(options_));
  ++contenders_;
}

bool KalmanBaseFilter::contender_is_believed() const {
  const double age_s = (contender_->time - contender_->begun).seconds();
  if (contender_->measurements < 5) return false;
  if (age_s >= options_.reacquire_s) return true;
  if (age_s < kReturn_s) return false;
  if (contender_returns()) return true;
  if (contenders_ < 2) return false;
  const MotionBelief mine = mixture_.belief(), theirs = contender_->mixture.belief();
  const Vector6d away = mine.error_of(theirs).head<6>();
  const Matrix6d reach = mine.covariance.topLeftCorner<6, 6>();
  return away.dot(reach.ldlt().solve(away)) < kGate;
}

std::optional<Pose<World, Base>> KalmanBaseFilter::earlier() const {
  if (!proven_) return std::nullopt;
  const MotionBelief proven = proven_->mixture.belief();
  if (is_same_place(proven, mixture_.belief())) return std::nullopt;
  return Pose<World, Base>{proven.rotation, proven.position_m};
}

bool KalmanBaseFilter::contender_returns() const {
  return earlier() && is_same_place(proven_->mixture.belief(), contender_->mixture.belief());
}

BaseState KalmanBaseFilter::update(const BaseMeasurement& measurement) {
  advance(measurement.time);
  if (!fits(measurement)) {
    drop_unconfirmed(measurement.time);
    advance(measurement.time);
  }
  if (fits(measurement)) {
    meter_.add(measurement, estimate(BaseTracking::kMeasured).world_from_base);
    accept(measurement);
    return estimate(BaseTracking::kMeasured);
  }
  meter_.interrupt();
  contend(measurement);
  if (!contender_is_believed()) return estimate(BaseTracking::kCoasting);
  mixture_ = contender_->mixture;
  measured_time_ = measurement.time;
  confirmed_ = Moment{mixture_, time_};
  is_confirmed_ = true;
  gate_.reset();
  contender_.reset();
  contenders_ = 0;
  ++statistics_.reacquisitions;
  return estimate(BaseTracking::kMeasured);
}

BaseState KalmanBaseFilter::coast(Time time) {
  drop_unconfirmed(time);
  advance(time);
  meter_.interrupt();
  return estimate(BaseTracking::kCoasting);
}

BaseFilterStatistics KalmanBaseFilter::statistics() const {
  BaseFilterStatistics s = statistics_;
  s.position_noise_m = std::sqrt(3.0) * meter_.noise().position_m;
  s.rotation_noise_rad = std::sqrt(3.0) * meter_.noise().rotation_rad;
  return s;
}

BaseState KalmanBaseFilter::estimate(BaseTracking tracking) const {
  const MotionBelief b = mixture_.belief();
  BaseState e;
  e.time = time_;
  e.tracking = tracking;
  e.world_from_base = {b.rotation, b.position_m};
  e.velocity_m_per_s = b.velocity_m_per_s;
  e.angular_velocity_rad_per_s = b.angular_velocity_rad_per_s;
  e.position_sigma_m = std::sqrt(b.covariance.topLeftCorner<3, 3>().trace());
  e.rotation_sigma_rad = std::sqrt(b.covariance.block<3, 3>(3, 3).trace());
  return e;
}

}  // namespace foresight::calibration
