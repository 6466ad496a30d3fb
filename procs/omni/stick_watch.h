// What of a device with sticks may be believed.
//
// An axis counts once it has rested near zero: triggers of some pads rest at −1, and on passing
// through zero they do not rest there. A stick that is deflected while the device says nothing for
// too long counts as let go: its last word may be old. Events that say nothing new are not sent by
// the joystick interface, but a hand trembles, so that silence is no proof, only unlikely.
//
//   StickWatch sticks(seconds(3), {0, 1, 4});
//   sticks.update(now, raw_axes, reported, has_spoken, dead_zone);   // each reading
//   if (sticks.counts(0)) …
//
// Pure; O(axes).
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/time.h"

namespace foresight {

class StickWatch {
 public:
  /// `used`: the axes that move something, from 0.
  StickWatch(Duration silence, std::vector<size_t> used)
      : silence_(silence), used_(std::move(used)) {}

  /// The device has been opened anew: no axis counts.
  void reset();
  /// `axes`: deflections of −1…1. `reported`: of each, whether the device has said it.
  /// `has_spoken`: anything since the last call.
  void update(Time now, std::span<const double> axes, const std::vector<bool>& reported,
              bool has_spoken, double dead_zone);

  bool counts(size_t axis) const { return axis < sticks_.size() && sticks_[axis].counts; }
  /// A used axis is deflected and the device has said nothing for too long.
  bool is_silent() const { return is_silent_; }
  /// One line about used axes that do not count though they are deflected; else empty.
  std::string complaint() const;

 private:
  struct Stick {
    bool counts = false, is_deflected = false;
    std::optional<Time> resting_since;
  };
  bool is_used(size_t axis) const;

  Duration silence_;
  std::vector<size_t> used_;
  std::vector<Stick> sticks_;
  std::optional<Time> last_word_;
  bool is_silent_ = false;
};

}  // namespace foresight
