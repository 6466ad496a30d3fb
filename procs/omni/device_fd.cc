#include "procs/omni/device_fd.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>

namespace foresight {

void DeviceFd::reset() {
  if (fd_ >= 0) close(fd_);
  fd_ = -1;
}

FdStatus DeviceFd::read_available(std::vector<uint8_t>* bytes) {
  constexpr int kMaxReads = 64;  // of a device that says more and more, the rest comes next time
  std::array<uint8_t, 512> buffer;
  for (int i = 0; i < kMaxReads; ++i) {
    pollfd state{.fd = fd_, .events = POLLIN, .revents = 0};
    if (poll(&state, 1, 0) <= 0) return FdStatus::kOk;
    if ((state.revents & POLLIN) == 0) return FdStatus::kGone;
    const ssize_t count = read(fd_, buffer.data(), buffer.size());
    if (count > 0) {
      bytes->insert(bytes->end(), buffer.begin(), buffer.begin() + count);
    } else {
      return count < 0 && (errno == EAGAIN || errno == EINTR) ? FdStatus::kOk : FdStatus::kGone;
    }
  }
  return FdStatus::kOk;
}

FdOpener file_opener(const std::string& path) {
  return
      [path] { return DeviceFd(open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY)); };
}

std::string last_system_error() { return std::generic_category().message(errno); }

}  // namespace foresight
