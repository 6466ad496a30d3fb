// Keys typed into a terminal as axes and a clutch.
//
//   KeyDecoder keys(0.2);
//   keys.feed('a', now);
//   keys.axes(now)[0] == 1;      // turns left until 0.2 s after the last 'a'
//
//   a d  or  ← →   axis 1      r f   axis 3      y h   axis 5      i k   axis 7
//   w s  or  ↑ ↓   axis 2      t g   axis 4      u j   axis 6
//   space  clutch on or off    q  quit
//
// A terminal tells what is typed, not what is held, and repeats a held key after a pause. So a key
// counts as held for a time after it was typed. Letting go of the clutch works at once; switching
// it on takes 0.7 s without a space, so that the repeats of a held space bar cannot switch it on.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/time.h"

namespace foresight {

class KeyDecoder {
 public:
  static constexpr int kAxes = 7;

  explicit KeyDecoder(double hold_s) : hold_(seconds(hold_s)) {}

  void feed(uint8_t byte, Time now);
  /// −1, 0 or 1 each.
  std::vector<double> axes(Time now) const;
  bool is_engaged() const { return engaged_; }
  bool wants_to_quit() const { return quit_; }
  void release() { engaged_ = false; }

 private:
  enum class Escape : uint8_t { kNone, kBegun, kArrow };
  struct Held {
    double direction = 0;
    Time typed;
  };
  void take_key(char key, Time now);
  void take_arrow(char letter, Time now);
  void press(int axis, double direction, Time now);
  void toggle(Time now);

  Duration hold_;
  std::array<Held, kAxes> held_;
  Escape escape_ = Escape::kNone;
  std::optional<Time> last_space_;
  bool engaged_ = false, quit_ = false;
};

}  // namespace foresight
