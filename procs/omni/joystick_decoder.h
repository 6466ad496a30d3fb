// Events of Linux' joystick interface (/dev/input/js*) as axes and buttons. Bytes may come in any
// pieces.
//
//   JoystickDecoder decoder;
//   decoder.feed(bytes);
//   const double left_stick_x = decoder.axes()[0];
//
// Source: Documentation/input/joydev/joystick-api.rst of Linux: events of 8 bytes, time in ms
// (u32), value (s16), type (u8: 1 button, 2 axis, +0x80 for the state at opening), number (u8).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace foresight {

class JoystickDecoder {
 public:
  void feed(std::span<const uint8_t> bytes);
  /// At rest, as after opening.
  void reset() { *this = JoystickDecoder(); }

  /// −1…1, at least eight.
  const std::vector<double>& axes() const { return axes_; }
  /// Of each axis, whether the device has said where it is.
  const std::vector<bool>& reported() const { return reported_; }
  /// 1: pressed; at least sixteen.
  const std::vector<uint8_t>& buttons() const { return buttons_; }

 private:
  void take_event();

  std::vector<double> axes_ = std::vector<double>(8, 0.0);
  std::vector<bool> reported_ = std::vector<bool>(8, false);
  std::vector<uint8_t> buttons_ = std::vector<uint8_t>(16, 0);
  std::vector<uint8_t> event_;  // the bytes of one so far
};

/// 0 inside the dead zone, from there on straight to ±1.
double without_dead_zone(double deflection, double dead_zone);

}  // namespace foresight
