// A gamepad or joystick through Linux' joystick interface. Its sticks stand for velocities; one
// button is the dead-man switch.
#pragma once

#include <string>

#include "procs/omni/device_fd.h"
#include "procs/omni/input_device.h"
#include "procs/omni/joystick_decoder.h"

namespace foresight {

struct GamepadOptions {
  std::string path = "/dev/input/js0";  // as error lines call it
  double dead_zone = 0.1;
  int clutch_button = 6;  // counted from 1; 6: right shoulder (xpad driver)
};

class GamepadDevice : public InputDevice {
 public:
  GamepadDevice(FdOpener opener, GamepadOptions options)
      : opener_(std::move(opener)), options_(std::move(options)) {}
  void open() override;
  DeviceReading read(Time now) override;

 private:
  bool try_open();

  FdOpener opener_;
  GamepadOptions options_;
  DeviceFd fd_;
  JoystickDecoder decoder_;
  RetryTimer retry_;
  std::string problem_;
};

}  // namespace foresight
