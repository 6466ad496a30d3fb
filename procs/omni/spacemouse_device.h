// A SpaceMouse through spacenavd and its library, which is loaded at run time. The declarations are
// our own, from the facts of its API. Its six axes stand for velocities: x right, y up, z towards
// the operator, then turns about them; a button is the dead-man switch.
#pragma once

#include <memory>
#include <string>

#include "procs/omni/device_library.h"
#include "procs/omni/input_device.h"

namespace foresight {

/// The functions of libspnav that we call.
struct SpnavApi {
  struct Motion {
    int type, x, y, z, rx, ry, rz;
    unsigned int period;
    int* data;
  };
  struct Button {
    int type, press, number;
  };
  union Event {
    int type;  // 1 motion, 2 button
    Motion motion;
    Button button;
  };

  explicit SpnavApi(const std::string& file);

  DeviceLibrary library;
  int (*open)() = nullptr;
  int (*close)() = nullptr;
  int (*fd)() = nullptr;
  int (*poll_event)(Event*) = nullptr;
};

struct SpaceMouseOptions {
  std::string library = "libspnav.so.0";
  double dead_zone = 0.1;
  int clutch_button = 1;  // counted from 1
};

class SpaceMouseDevice : public InputDevice {
 public:
  explicit SpaceMouseDevice(SpaceMouseOptions options) : options_(std::move(options)) {}
  ~SpaceMouseDevice() override;
  void open() override;
  DeviceReading read(Time now) override;

 private:
  void drain(Time now);
  bool daemon_is_there() const;
  void take(const SpnavApi::Event& event);

  SpaceMouseOptions options_;
  std::unique_ptr<SpnavApi> api_;
  bool connected_ = false;
  std::vector<double> axes_ = std::vector<double>(6, 0.0);
  std::vector<uint8_t> buttons_ = std::vector<uint8_t>(2, 0);
  Time last_event_;
  RetryTimer retry_;
};

}  // namespace foresight
