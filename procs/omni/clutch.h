// The dead-man switch: whether what the operator does with the device is meant for the arm.
#pragma once

#include <cstdint>

namespace foresight {

enum class ClutchMode : uint8_t {
  kHold,    // engaged while the switch is held
  kToggle,  // each press changes it
};

class Clutch {
 public:
  explicit Clutch(ClutchMode mode) : mode_(mode) {}

  /// Once per reading. `usable`: the device is there and the robot is ready for it. The switch must
  /// be seen let go once before it counts, at first and whenever it was not usable: nobody may be
  /// holding the device when it returns, and nobody means an arm that comes to life later.
  bool update(bool usable, bool pressed) {
    if (!usable) {
      needs_release_ = true;
      on_ = false;
    } else if (needs_release_) {
      needs_release_ = pressed;
    } else if (mode_ == ClutchMode::kHold) {
      on_ = pressed;
    } else if (pressed && !was_pressed_) {
      on_ = !on_;
    }
    was_pressed_ = pressed;
    return on_;
  }
  bool needs_release() const { return needs_release_; }

 private:
  ClutchMode mode_;
  bool on_ = false, was_pressed_ = false, needs_release_ = true;
};

}  // namespace foresight
