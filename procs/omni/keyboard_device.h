// Keys typed into a terminal (key_decoder.h). The terminal is in raw mode meanwhile: no echo, no
// waiting for return; Ctrl-C still ends the process.
#pragma once

#include <termios.h>

#include <memory>
#include <string>

#include "procs/omni/device_fd.h"
#include "procs/omni/input_device.h"
#include "procs/omni/key_decoder.h"

namespace foresight {

struct KeyboardOptions {
  std::string name = "standard input";  // as error lines call it
  double hold_s = 0.2;                  // a key counts as held so long after it was typed
  bool needs_terminal = true;           // refuse anything else (a pipe, /dev/null)
};

class KeyboardDevice : public InputDevice {
 public:
  KeyboardDevice(FdOpener opener, KeyboardOptions options)
      : opener_(std::move(opener)), options_(std::move(options)), keys_(options_.hold_s) {}
  void open() override;
  DeviceReading read(Time now) override;
  void allow_engaging(bool may_engage) override {
    if (!may_engage) keys_.release();
  }

 private:
  // Raw from construction to destruction.
  class RawTerminal {
   public:
    explicit RawTerminal(int fd);
    ~RawTerminal();
    RawTerminal(const RawTerminal&) = delete;
    RawTerminal& operator=(const RawTerminal&) = delete;

   private:
    int fd_;
    bool changed_ = false;
    termios before_;
  };
  bool try_open();

  FdOpener opener_;
  KeyboardOptions options_;
  KeyDecoder keys_;
  DeviceFd fd_;
  std::unique_ptr<RawTerminal> raw_;  // after fd_: restored before it is closed
  RetryTimer retry_;
  std::string problem_;
};

/// A copy of standard input.
FdOpener standard_input_opener();

}  // namespace foresight
