// One LCM domain: opens it with a clear error, publishes bytes, hands received bytes on. Multicast
// ("udpm://", what sites use) is received by our own common/udpm_receiver.h, everything else
// ("memq://", which tests use) by liblcm.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/channel_pattern.h"
#include "common/host.h"

struct _lcm_t;

namespace foresight {

class UdpmReceiver;

/// The URL of a domain: $FORESIGHT_ROBOT_URL or $FORESIGHT_OPERATOR_URL, else loopback multicast
/// with TTL 0. The two use different ports, because liblcm's groups on one port leak into each
/// other.
std::string default_url(Domain domain);

class LcmBus {
 public:
  /// Throws UnavailableError with the command that mends the network.
  explicit LcmBus(const std::string& url);
  ~LcmBus();
  LcmBus(const LcmBus&) = delete;
  LcmBus& operator=(const LcmBus&) = delete;

  using Receiver = std::function<void(const std::string& channel, std::span<const uint8_t>)>;
  /// `channel`: a name, or an expression (ChannelPattern). Throws UnavailableError when the bus
  /// cannot be listened to, UsageError for a wrong expression.
  void subscribe(const std::string& channel, Receiver receiver);
  void publish(const std::string& channel, std::span<const uint8_t> bytes);
  /// Readable when something has arrived; −1 while nothing is subscribed.
  int file_descriptor() const;
  /// Hands on what has arrived until now, without waiting.
  void receive();
  /// One line when the kernel gives less socket buffer than the URL asks for, else empty.
  const std::string& complaint() const { return complaint_; }
  /// Messages that were dropped because this process does not keep up with what it hears.
  int64_t dropped() const;

 private:
  struct Subscription {
    ChannelPattern pattern;
    Receiver receiver;
  };
  _lcm_t* lcm_ = nullptr;
  std::string url_;
  std::vector<std::unique_ptr<Subscription>> subscriptions_;
  std::unique_ptr<UdpmReceiver> udpm_;  // from the first subscription on
  bool is_udpm_ = false;
  std::string complaint_;
};

}  // namespace foresight
