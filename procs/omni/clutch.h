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

  /// Once per reading. After the device had gone, the switch must be let go before it counts again:
  /// nobody may be holding the device when it returns.
  bool update(bool connected, bool pressed) {
    if (!connected) {
      lost_ = true;
      on_ = false;
    } else if (lost_) {
      lost_ = pressed;
    } else if (mode_ == ClutchMode::kHold) {
      on_ = pressed;
    } else if (pressed && !was_pressed_) {
      on_ = !on_;
    }
    was_pressed_ = pressed;
    return on_;
  }

 private:
  ClutchMode mode_;
  bool on_ = false, was_pressed_ = false, lost_ = false;
};

}  // namespace foresight
