// A file descriptor that a device is read from: owned, and never waited for.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace foresight {

enum class FdStatus : uint8_t { kOk, kGone };

class DeviceFd {
 public:
  explicit DeviceFd(int fd = -1) : fd_(fd) {}
  ~DeviceFd() { reset(); }
  DeviceFd(DeviceFd&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  DeviceFd& operator=(DeviceFd&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  DeviceFd(const DeviceFd&) = delete;
  DeviceFd& operator=(const DeviceFd&) = delete;

  bool is_open() const { return fd_ >= 0; }
  int get() const { return fd_; }
  void reset();
  /// Appends what is there now. kGone at the end of the file, on an error and when the other side
  /// has hung up.
  [[nodiscard]] FdStatus read_available(std::vector<uint8_t>* bytes);

 private:
  int fd_;
};

/// Opens the device; on failure a closed descriptor, and errno says why.
using FdOpener = std::function<DeviceFd()>;
FdOpener file_opener(const std::string& path);

/// What errno means, as text.
std::string last_system_error();

}  // namespace foresight
