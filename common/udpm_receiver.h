// Receives the messages of one LCM multicast group in a thread of its own, in place of liblcm's
// receiver: checked (common/datagram_assembler.h), bounded in memory, and from this group alone.
//
//   UdpmReceiver receiver(*parse_udpm_url(url));
//   receiver.listen_to(ChannelPattern("VIEW"));
//   poll(receiver.file_descriptor()); for (LcmMessage& m : receiver.take()) …
//
// liblcm binds its socket to every address of the port, so it takes messages of other groups and
// those sent to this host alone; this one is bound to the group's address.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/channel_pattern.h"
#include "common/datagram_assembler.h"

namespace foresight {

struct UdpmAddress {
  uint32_t group = 0;  // IPv4, host's byte order
  uint16_t port = 0;
  int buffer_bytes = 0;  // of the socket; 0: the system's default
};

/// Of "udpm://GROUP:PORT?recv_buf_size=N…"; nothing for another kind of URL, or when GROUP:PORT is
/// not a multicast address with a port.
std::optional<UdpmAddress> parse_udpm_url(const std::string& url);

class UdpmReceiver {
 public:
  /// Of messages that wait to be taken. Beyond it the oldest are dropped: what is newest is worth
  /// most, and who needs all of a stream notices the gap and asks.
  static constexpr size_t kWaiting_bytes = size_t{64} << 20;

  /// Receives from now on. Throws UnavailableError when there is no such socket to be had.
  explicit UdpmReceiver(const UdpmAddress& address);
  ~UdpmReceiver();
  UdpmReceiver(const UdpmReceiver&) = delete;
  UdpmReceiver& operator=(const UdpmReceiver&) = delete;

  /// Messages of channels that nothing listens to are dropped as they come.
  void listen_to(const ChannelPattern& pattern);
  /// Readable while messages wait.
  int file_descriptor() const { return event_; }
  /// All that wait, in the order of arrival.
  std::deque<LcmMessage> take();
  /// Messages that were dropped because they waited too long.
  int64_t dropped() const { return dropped_; }
  /// Datagrams that were none of LCM's, or contradicted themselves.
  int64_t malformed() const { return malformed_; }

 private:
  void open_socket(const UdpmAddress& address);
  void close_all();
  void loop();
  void receive_some();
  void keep(LcmMessage message);

  int socket_ = -1, event_ = -1, stop_event_ = -1;
  // The thread's.
  DatagramAssembler assembler_;
  std::vector<uint8_t> datagram_;
  std::atomic<int64_t> dropped_{0}, malformed_{0};
  std::mutex mutex_;
  std::vector<ChannelPattern> patterns_;
  std::deque<LcmMessage> waiting_;
  size_t waiting_bytes_ = 0;
  std::thread thread_;
};

}  // namespace foresight
