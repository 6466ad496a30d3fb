// One LCM domain: opens it with a clear error, publishes bytes, hands received bytes on.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "common/host.h"

struct _lcm_t;

namespace foresight {

/// The URL of a domain: $FORESIGHT_ROBOT_URL or $FORESIGHT_OPERATOR_URL, else loopback multicast
/// with TTL 0. The two use different ports, because groups on one port leak into each other.
std::string default_url(Domain domain);

class LcmBus {
 public:
  /// Throws UnavailableError with the command that mends the network.
  explicit LcmBus(const std::string& url);
  ~LcmBus();
  LcmBus(const LcmBus&) = delete;
  LcmBus& operator=(const LcmBus&) = delete;

  using Receiver = std::function<void(const std::string& channel, std::span<const uint8_t>)>;
  /// `channel` is a regular expression, anchored at both ends. All subscriptions are made before
  /// the first receive().
  void subscribe(const std::string& channel, Receiver receiver);
  void publish(const std::string& channel, std::span<const uint8_t> bytes);
  int file_descriptor() const;
  /// Hands on everything that has arrived, without waiting.
  void receive();
  /// One line when the kernel gives less socket buffer than the URL asks for, else empty.
  const std::string& complaint() const { return complaint_; }

 private:
  struct Subscription {
    Receiver receiver;
  };
  _lcm_t* lcm_ = nullptr;
  std::vector<std::unique_ptr<Subscription>> subscriptions_;
  std::string complaint_;
};

}  // namespace foresight
