#include "procs/omni/stick_watch.h"

#include <algorithm>
#include <cmath>

namespace foresight {
namespace {

constexpr double kNearZero = 0.15;  // where worn sticks rest, or within the dead zone
constexpr Duration kRest = milliseconds(200);

}  // namespace

void StickWatch::reset() {
  sticks_.clear();
  last_word_.reset();
  is_silent_ = false;
}

bool StickWatch::is_used(size_t axis) const {
  return std::find(used_.begin(), used_.end(), axis) != used_.end();
}

void StickWatch::update(Time now, std::span<const double> axes, const std::vector<bool>& reported,
                        bool has_spoken, double dead_zone) {
  if (has_spoken || !last_word_) last_word_ = now;
  sticks_.resize(axes.size());
  bool moves_something = false;
  for (size_t i = 0; i < axes.size(); ++i) {
    Stick& stick = sticks_[i];
    const double size = std::abs(axes[i]);
    stick.is_deflected = size > std::max(dead_zone, kNearZero);
    const bool rests = i < reported.size() && reported[i] && !stick.is_deflected;
    if (!rests) {
      stick.resting_since.reset();
    } else if (!stick.resting_since) {
      stick.resting_since = now;
    }
    stick.counts = stick.counts || (rests && now - *stick.resting_since >= kRest);
    moves_something = moves_something || (stick.counts && size > dead_zone && is_used(i));
  }
  is_silent_ = moves_something && now - *last_word_ >= silence_;
}

std::string StickWatch::complaint() const {
  for (const size_t axis : used_) {
    if (axis >= sticks_.size() || sticks_[axis].counts || !sticks_[axis].is_deflected) continue;
    return "axis " + std::to_string(axis + 1) + " does not count before it has rested near zero";
  }
  return {};
}

}  // namespace foresight
