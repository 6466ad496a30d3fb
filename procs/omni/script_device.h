// The simulated Omni: moves by itself (script_motion.h), engaged from the start delay on.
#pragma once

#include <optional>

#include "procs/omni/input_device.h"
#include "procs/omni/script_motion.h"

namespace foresight {

class ScriptDevice : public InputDevice {
 public:
  ScriptDevice(ScriptMotion motion, double start_delay_s)
      : motion_(std::move(motion)), start_delay_s_(start_delay_s) {}
  void open() override {}
  DeviceReading read(Time now) override {
    if (!started_) started_ = now;
    const double time_s = (now - *started_).seconds() - start_delay_s_;
    DeviceReading reading{.connected = true, .engaged = time_s >= 0};
    reading.axes = motion_.at(time_s);
    reading.buttons = {static_cast<uint8_t>(reading.engaged ? 1 : 0)};
    return reading;
  }

 private:
  ScriptMotion motion_;
  double start_delay_s_;
  std::optional<Time> started_;
};

}  // namespace foresight
