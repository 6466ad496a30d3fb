#include "procs/omni/keyboard_device.h"

#include <fcntl.h>
#include <unistd.h>

#include <iostream>

#include "common/errors.h"

namespace foresight {
namespace {

// In the background of its own terminal a process is stopped when it reads or sets modes.
bool is_in_background(int fd) {
  const pid_t foreground = tcgetpgrp(fd);
  return foreground >= 0 && foreground != getpgrp();
}

}  // namespace

KeyboardDevice::RawTerminal::RawTerminal(int fd) : fd_(fd) {
  if (tcgetattr(fd, &before_) != 0) return;
  termios raw = before_;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  raw.c_cc[VMIN] = raw.c_cc[VTIME] = 0;
  changed_ = tcsetattr(fd, TCSANOW, &raw) == 0;
}

KeyboardDevice::RawTerminal::~RawTerminal() {
  if (changed_) tcsetattr(fd_, TCSANOW, &before_);
}

bool KeyboardDevice::try_open() {
  raw_.reset();
  fd_ = opener_();
  if (!fd_.is_open()) {
    problem_ = options_.name + ": " + last_system_error();
  } else if (options_.needs_terminal && isatty(fd_.get()) == 0) {
    problem_ = options_.name + ": is no terminal";
  } else if (isatty(fd_.get()) != 0 && is_in_background(fd_.get())) {
    problem_ = options_.name + ": the process is in the background of its terminal";
  } else {
    raw_ = std::make_unique<RawTerminal>(fd_.get());
    return true;
  }
  fd_.reset();
  return false;
}

void KeyboardDevice::open() {
  if (!try_open()) {
    throw UnavailableError("device=keyboard: " + problem_ +
                           "; run it in the foreground of a terminal (scripts/run omni --set "
                           "device=keyboard), or give device_path=TERMINAL_OR_FIFO");
  }
  if (isatty(fd_.get()) == 0) return;
  std::cerr << "omni: keys: space = clutch, a d = joint 1, w s = joint 2, r f = joint 4, t g = "
               "joint 3, q = quit\n";
}

DeviceReading KeyboardDevice::read(Time now) {
  if (!fd_.is_open() && retry_.due(now)) static_cast<void>(try_open());
  if (fd_.is_open()) {
    std::vector<uint8_t> bytes;
    const FdStatus status = fd_.read_available(&bytes);
    for (const uint8_t byte : bytes) keys_.feed(byte, now);
    if (status == FdStatus::kGone) {
      problem_ = options_.name + ": has been closed; trying again";
      raw_.reset();
      fd_.reset();
      keys_.release();
      static_cast<void>(retry_.due(now));
    }
  }
  DeviceReading reading{.connected = fd_.is_open(), .kind = AxisKind::kVelocity};
  reading.engaged = keys_.is_engaged();
  reading.quit = keys_.wants_to_quit();
  reading.axes = keys_.axes(now);
  if (!reading.connected) reading.problem = problem_;
  return reading;
}

FdOpener standard_input_opener() {
  return [] { return DeviceFd(fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 3)); };
}

}  // namespace foresight
