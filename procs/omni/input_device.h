// What the operator holds in his hand, as the rest of the process sees it. Back-ends: script,
// files, OpenHaptics, gamepad, keyboard, SpaceMouse (*_device.h).
//
//   device->open();                                  // once; throws StartupError
//   device->allow_engaging(robot_is_ready);
//   const DeviceReading reading = device->read(now);  // at 30 Hz; never waits
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/time.h"

namespace foresight {

enum class AxisKind : uint8_t {
  kPosition,  // the device has joints: axes are their positions in rad
  kVelocity,  // axes are deflections of −1…1 that stand for a velocity
};

struct DeviceReading {
  bool connected = false;
  bool engaged = false;  // the clutch (dead-man switch) as the device reports it
  bool silent = false;   // moves something, but has said nothing for too long: counts as let go
  bool ended = false;    // a recording is over
  bool quit = false;     // the operator asked the process to end
  AxisKind kind = AxisKind::kPosition;
  std::vector<double> axes = {};      // by kind; the last known ones while not connected
  std::vector<uint8_t> buttons = {};  // 1: pressed
  std::string problem = {};           // one line when something is wrong; else empty
};

class InputDevice {
 public:
  virtual ~InputDevice() = default;
  /// Throws UnavailableError when there is no such device, ConfigError for a file that is wrong.
  virtual void open() = 0;
  /// What the device says now. One that has gone reads as not connected and is tried again once a
  /// second. `now` never goes back.
  virtual DeviceReading read(Time now) = 0;
  /// Whether engaging has an effect now, before each reading. Devices that keep the clutch
  /// themselves let it go when it has none; those that move by themselves wait.
  virtual void allow_engaging(bool /*may_engage*/) {}
  /// One line for people: which device it is, and what moves what. Empty: nothing to say.
  virtual std::string description() const { return {}; }
};

/// When to try again to open a device that has gone: once a second.
class RetryTimer {
 public:
  bool due(Time now) {
    if (tried_ && now - last_ < seconds(1)) return false;
    tried_ = true;
    last_ = now;
    return true;
  }

 private:
  bool tried_ = false;
  Time last_;
};

}  // namespace foresight
