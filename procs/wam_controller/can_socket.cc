#include "procs/wam_controller/can_socket.h"

#include <fcntl.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "common/errors.h"

namespace foresight {
namespace {

[[noreturn]] void refuse(const std::string& interface, const std::string& what) {
  throw UnavailableError("can_interface: " + interface + ": " + what + ": " + std::strerror(errno) +
                         " (ip link set " + interface + " up type can bitrate 1000000)");
}

}  // namespace

CanSocket::CanSocket(const std::string& interface) {
  const unsigned int index = if_nametoindex(interface.c_str());
  if (index == 0) refuse(interface, "no such network interface");
  socket_ = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (socket_ < 0) refuse(interface, "no CAN socket");
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(index);
  if (bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    const int error = errno;
    close(socket_);
    errno = error;
    refuse(interface, "cannot be opened");
  }
}

CanSocket::~CanSocket() { close(socket_); }

bool CanSocket::send(const CanFrame& frame) {
  can_frame raw{};
  raw.can_id = frame.id;
  raw.can_dlc = frame.size;
  std::copy(frame.data.begin(), frame.data.end(), raw.data);
  return write(socket_, &raw, sizeof raw) == static_cast<ssize_t>(sizeof raw);
}

bool CanSocket::receive(Duration longest, CanFrame* frame) {
  pollfd waiting{socket_, POLLIN, 0};
  const timespec timeout{longest.us / 1'000'000, (longest.us % 1'000'000) * 1000};
  if (ppoll(&waiting, 1, &timeout, nullptr) <= 0) return false;
  can_frame raw{};
  if (read(socket_, &raw, sizeof raw) != static_cast<ssize_t>(sizeof raw)) return false;
  if ((raw.can_id & (CAN_EFF_FLAG | CAN_RTR_FLAG | CAN_ERR_FLAG)) != 0) {
    *frame = {};  // no frame of ours: read_feedback() passes it over
    return true;
  }
  frame->id = static_cast<uint16_t>(raw.can_id & CAN_SFF_MASK);
  frame->size = std::min<uint8_t>(raw.can_dlc, CAN_MAX_DLEN);
  std::copy_n(raw.data, frame->data.size(), frame->data.begin());
  return true;
}

}  // namespace foresight
