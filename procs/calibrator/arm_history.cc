#include "procs/calibrator/arm_history.h"

#include <algorithm>

#include "procs/calibrator/geometry.h"

namespace foresight::calibration {

ArmHistory::Added ArmHistory::add(Time time, const Pose<Base, Ee>& base_from_ee) {
  const ArmSample sample{time, base_from_ee};
  Added added = Added::kAdded;
  if (!samples_.empty()) {
    const ArmSample& last = samples_.back();
    if (time <= last.time && last.time - time < seconds(1)) return Added::kNotNewer;
    if (time < last.time || is_jump(last, sample)) {
      const bool is_believed = doubted_ && doubted_->time < time && !is_jump(*doubted_, sample);
      if (!is_believed) {
        doubted_ = sample;
        return Added::kDoubted;
      }
      samples_ = {*doubted_};
      added = Added::kJump;
    }
  }
  doubted_.reset();
  samples_.push_back(sample);
  while ((time - samples_.front().time).seconds() > options_.length_s) samples_.pop_front();
  return added;
}

bool ArmHistory::is_jump(const ArmSample& a, const ArmSample& b) const {
  const double step_s = (b.time - a.time).seconds();
  const Pose<Base, Ee>&pa = a.base_from_ee, &pb = b.base_from_ee;
  return (pb.translation() - pa.translation()).norm() > options_.max_speed_m_per_s * step_s ||
         angle_between(pa.rotation(), pb.rotation()) > options_.max_turn_rad_per_s * step_s;
}

std::optional<ArmMotion> ArmHistory::at(Time time) const {
  if (samples_.size() < 2) return std::nullopt;
  const auto after = std::lower_bound(samples_.begin(), samples_.end(), time,
                                      [](const ArmSample& s, Time t) { return s.time < t; });
  if (after == samples_.end() || (after == samples_.begin() && after->time != time)) {
    return std::nullopt;
  }
  const auto b = after == samples_.begin() ? after + 1 : after;
  const auto a = b - 1;
  if (is_gap(*a, *b)) return std::nullopt;
  return interpolate(*a, *b, (time - a->time).seconds() / (b->time - a->time).seconds());
}

std::optional<ArmTrack> ArmHistory::around(Time centre, Duration half_width) const {
  const auto earlier = [](const ArmSample& s, Time t) { return s.time < t; };
  auto first = std::lower_bound(samples_.begin(), samples_.end(), centre - half_width, earlier);
  const auto last = std::lower_bound(first, samples_.end(), centre + half_width, earlier);
  if (first == samples_.begin() || last == samples_.end()) return std::nullopt;
  --first;
  ArmTrack track{centre, {first, last + 1}};
  for (size_t i = 1; i < track.samples.size(); ++i) {
    if (is_gap(track.samples[i - 1], track.samples[i])) return std::nullopt;
  }
  return track;
}

}  // namespace foresight::calibration
