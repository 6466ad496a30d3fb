// A gamepad or joystick through Linux' joystick interface. Its sticks stand for velocities; one
// button is the dead-man switch. What counts: stick_watch.h.
#pragma once

#include <string>

#include "procs/omni/device_fd.h"
#include "procs/omni/input_device.h"
#include "procs/omni/joint_mapping.h"
#include "procs/omni/joystick_decoder.h"
#include "procs/omni/stick_watch.h"

namespace foresight {

struct GamepadOptions {
  std::string path = "/dev/input/js0";  // as error lines call it
  double dead_zone = 0.1;
  int clutch_button = 6;  // counted from 1; 6: right shoulder (xpad driver)
  double silence_s = 3;   // a deflected stick without an event for so long counts as let go
  JointMapping mapping = gamepad_mapping();  // which axes are used, and for what
};

class GamepadDevice : public InputDevice {
 public:
  GamepadDevice(FdOpener opener, GamepadOptions options);
  void open() override;
  DeviceReading read(Time now) override;
  /// Its name as the driver says it (once it has been opened), and what moves what.
  std::string description() const override;

 private:
  bool try_open();
  void receive(Time now);

  FdOpener opener_;
  GamepadOptions options_;
  DeviceFd fd_;
  std::string name_;
  JoystickDecoder decoder_;
  StickWatch sticks_;
  RetryTimer retry_;
  std::string problem_;
};

}  // namespace foresight
