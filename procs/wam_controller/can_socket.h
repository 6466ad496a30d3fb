// A CAN bus through Linux' SocketCAN, as the arm's CanBus.
#pragma once

#include <string>

#include "procs/wam_controller/can_bus.h"

namespace foresight {

class CanSocket : public CanBus {
 public:
  /// Opens an interface ("can0") that is up at 1 Mbit/s. Throws UnavailableError.
  explicit CanSocket(const std::string& interface);
  ~CanSocket() override;
  CanSocket(const CanSocket&) = delete;
  CanSocket& operator=(const CanSocket&) = delete;

  bool send(const CanFrame& frame) override;
  bool receive(Duration longest, CanFrame* frame) override;

 private:
  int socket_ = -1;
};

}  // namespace foresight
