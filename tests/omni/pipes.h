// A device at the end of a pipe: the test writes what the device says, and may unplug it.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <string_view>
#include <vector>

#include "procs/omni/device_fd.h"

namespace foresight {

class PipeDevice {
 public:
  ~PipeDevice() { unplug(); }
  /// Each opening makes a new pipe; fails while there is no device.
  FdOpener opener() {
    return [this] {
      ++openings;
      if (!is_plugged) {
        errno = ENOENT;
        return DeviceFd();
      }
      int ends[2] = {-1, -1};
      if (pipe2(ends, O_CLOEXEC | O_NONBLOCK) != 0) return DeviceFd();
      if (writer_ >= 0) close(writer_);
      writer_ = ends[1];
      return DeviceFd(ends[0]);
    };
  }
  bool send(const void* bytes, size_t count) {
    return write(writer_, bytes, count) == static_cast<ssize_t>(count);
  }
  bool send(std::string_view text) { return send(text.data(), text.size()); }
  void unplug() {
    is_plugged = false;
    if (writer_ >= 0) close(writer_);
    writer_ = -1;
  }

  bool is_plugged = true;
  int openings = 0;

 private:
  int writer_ = -1;
};

}  // namespace foresight
