// A CAN bus as the arm needs it: SocketCAN (can_socket.h), or a fake one in tests.
#pragma once

#include "common/time.h"
#include "procs/wam_controller/puck_codec.h"

namespace foresight {

class CanBus {
 public:
  virtual ~CanBus() = default;
  /// False when the bus does not take the frame.
  [[nodiscard]] virtual bool send(const CanFrame& frame) = 0;
  /// Waits at most `longest` for a frame; false when none came, or on an error.
  [[nodiscard]] virtual bool receive(Duration longest, CanFrame* frame) = 0;
};

}  // namespace foresight
