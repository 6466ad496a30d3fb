#include "procs/omni/gamepad_device.h"

#include "common/errors.h"

namespace foresight {

bool GamepadDevice::try_open() {
  fd_ = opener_();
  decoder_.reset();
  if (!fd_.is_open()) problem_ = options_.path + ": " + last_system_error();
  return fd_.is_open();
}

void GamepadDevice::open() {
  if (try_open()) return;
  throw UnavailableError("device_path: " + problem_ +
                         " (is the gamepad plugged in, is the module joydev loaded, and are you in "
                         "group input?)");
}

DeviceReading GamepadDevice::read(Time now) {
  if (!fd_.is_open() && retry_.due(now)) static_cast<void>(try_open());
  if (fd_.is_open()) {
    std::vector<uint8_t> bytes;
    if (fd_.read_available(&bytes) == FdStatus::kOk) {
      decoder_.feed(bytes);
    } else {
      problem_ = options_.path + ": the gamepad has gone; trying again";
      fd_.reset();
      static_cast<void>(retry_.due(now));
    }
  }
  DeviceReading reading{.connected = fd_.is_open(), .kind = AxisKind::kVelocity};
  for (const double axis : decoder_.axes()) {
    reading.axes.push_back(without_dead_zone(axis, options_.dead_zone));
  }
  reading.buttons = decoder_.buttons();
  const auto clutch = static_cast<size_t>(options_.clutch_button - 1);
  reading.engaged = reading.connected && clutch < reading.buttons.size() && reading.buttons[clutch];
  if (!reading.connected) reading.problem = problem_;
  return reading;
}

}  // namespace foresight
