#include "procs/omni/gamepad_device.h"

#include <linux/joystick.h>
#include <sys/ioctl.h>

#include <array>

#include "common/errors.h"

namespace foresight {
namespace {

// Empty for what is no joystick (a pipe).
std::string read_name(int fd) {
  std::array<char, 128> name{};
  if (ioctl(fd, JSIOCGNAME(name.size() - 1), name.data()) < 0) return {};
  return name.data();
}

std::vector<size_t> used_axes(const JointMapping& mapping) {
  std::vector<size_t> used;
  for (const JointSource& joint : mapping.joints) {
    if (joint.axis > 0) used.push_back(static_cast<size_t>(joint.axis) - 1);
  }
  return used;
}

}  // namespace

GamepadDevice::GamepadDevice(FdOpener opener, GamepadOptions options)
    : opener_(std::move(opener)),
      options_(std::move(options)),
      sticks_(seconds(options_.silence_s), used_axes(options_.mapping)) {}

bool GamepadDevice::try_open() {
  fd_ = opener_();
  decoder_.reset();
  sticks_.reset();
  if (fd_.is_open()) {
    name_ = read_name(fd_.get());
  } else {
    problem_ = options_.path + ": " + last_system_error();
  }
  return fd_.is_open();
}

void GamepadDevice::open() {
  if (try_open()) return;
  throw UnavailableError("device_path: " + problem_ +
                         " (is the gamepad plugged in, is the module joydev loaded, and are you in "
                         "group input?)");
}

void GamepadDevice::receive(Time now) {
  std::vector<uint8_t> bytes;
  if (fd_.read_available(&bytes) == FdStatus::kOk) {
    decoder_.feed(bytes);
    sticks_.update(now, decoder_.axes(), decoder_.reported(), !bytes.empty(), options_.dead_zone);
    return;
  }
  problem_ = options_.path + ": the gamepad has gone; trying again";
  fd_.reset();
  sticks_.reset();
  static_cast<void>(retry_.due(now));
}

DeviceReading GamepadDevice::read(Time now) {
  if (!fd_.is_open() && retry_.due(now)) static_cast<void>(try_open());
  if (fd_.is_open()) receive(now);
  DeviceReading reading{.connected = fd_.is_open(), .kind = AxisKind::kVelocity};
  const std::vector<double>& axes = decoder_.axes();
  for (size_t i = 0; i < axes.size(); ++i) {
    const double counted = sticks_.counts(i) ? axes[i] : 0;
    reading.axes.push_back(without_dead_zone(counted, options_.dead_zone));
  }
  reading.buttons = decoder_.buttons();
  const auto clutch = static_cast<size_t>(options_.clutch_button - 1);
  reading.engaged = reading.connected && clutch < reading.buttons.size() && reading.buttons[clutch];
  reading.silent = reading.engaged && sticks_.is_silent();
  if (!reading.connected) {
    reading.problem = problem_;
  } else if (reading.silent) {
    reading.problem = "a stick is held, but the gamepad says nothing: counts as let go";
  } else {
    reading.problem = sticks_.complaint();
  }
  return reading;
}

std::string GamepadDevice::description() const {
  return "gamepad " + (name_.empty() ? "(without a name)" : name_) + " at " + options_.path + ": " +
         options_.mapping.description() + "; clutch: button " +
         std::to_string(options_.clutch_button);
}

}  // namespace foresight
