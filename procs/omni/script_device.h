// The simulated Omni: a hand that moves by itself (script_motion.h), engaged from the start delay
// on. When the robot does not follow it lets go, waits until it may engage, and presses again.
#pragma once

#include "procs/omni/input_device.h"
#include "procs/omni/playback.h"
#include "procs/omni/script_motion.h"

namespace foresight {

class ScriptDevice : public InputDevice {
 public:
  ScriptDevice(ScriptMotion motion, double start_delay_s)
      : motion_(std::move(motion)), playback_(start_delay_s, true) {}
  void open() override {}
  DeviceReading read(Time now) override {
    playback_.update(now);
    DeviceReading reading{.connected = true, .engaged = playback_.is_running()};
    reading.axes = motion_.at(playback_.time_s());
    reading.buttons = {static_cast<uint8_t>(reading.engaged ? 1 : 0)};
    return reading;
  }
  void allow_engaging(bool may_engage) override { playback_.allow(may_engage); }

 private:
  ScriptMotion motion_;
  Playback playback_;
};

}  // namespace foresight
