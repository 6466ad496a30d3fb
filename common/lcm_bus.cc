#include "common/lcm_bus.h"

#include <lcm/lcm.h>

#include <cstdlib>
#include <fstream>

#include "common/errors.h"
#include "common/udpm_receiver.h"

namespace foresight {
namespace {

// The kernel caps a socket's buffer at rmem_max without a word: large messages are then lost.
std::string find_buffer_complaint(const std::string& url) {
  const size_t at = url.find("recv_buf_size=");
  if (at == std::string::npos) return {};
  const int64_t wanted = std::atoll(url.c_str() + at + 14);
  int64_t limit = 0;
  std::ifstream("/proc/sys/net/core/rmem_max") >> limit;
  if (limit == 0 || limit >= wanted) return {};
  return "socket buffer limited to " + std::to_string(limit / 1024) + " of " +
         std::to_string(wanted / 1024) + " KiB: run scripts/setup --network";
}

}  // namespace

std::string default_url(Domain domain) {
  const bool robot = domain == Domain::kRobot;
  if (const char* url = std::getenv(robot ? "FORESIGHT_ROBOT_URL" : "FORESIGHT_OPERATOR_URL")) {
    return url;
  }
  return robot ? "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304"
               : "udpm://239.255.76.68:7668?ttl=0&recv_buf_size=4194304";
}

LcmBus::LcmBus(const std::string& url)
    : lcm_(lcm_create(url.c_str())), url_(url), is_udpm_(parse_udpm_url(url).has_value()) {
  if (lcm_ == nullptr) {
    throw UnavailableError("LCM " + url +
                           " cannot be opened: bad URL, or no multicast route on this host (run "
                           "scripts/setup --network)");
  }
  complaint_ = find_buffer_complaint(url);
}

LcmBus::~LcmBus() { lcm_destroy(lcm_); }

void LcmBus::subscribe(const std::string& channel, Receiver receiver) {
  subscriptions_.push_back(
      std::make_unique<Subscription>(Subscription{ChannelPattern(channel), std::move(receiver)}));
  if (is_udpm_) {
    if (!udpm_) udpm_ = std::make_unique<UdpmReceiver>(*parse_udpm_url(url_));
    return udpm_->listen_to(subscriptions_.back()->pattern);
  }
  const auto on_message = [](const lcm_recv_buf_t* buffer, const char* name, void* user) {
    static_cast<Subscription*>(user)->receiver(
        name, {static_cast<const uint8_t*>(buffer->data), buffer->data_size});
  };
  lcm_subscription_t* subscription =
      lcm_subscribe(lcm_, channel.c_str(), on_message, subscriptions_.back().get());
  // The library would drop the newest of 30.
  lcm_subscription_set_queue_capacity(subscription, 0);
}

void LcmBus::publish(const std::string& channel, std::span<const uint8_t> bytes) {
  lcm_publish(lcm_, channel.c_str(), bytes.data(), static_cast<unsigned>(bytes.size()));
}

int LcmBus::file_descriptor() const {
  if (is_udpm_) return udpm_ ? udpm_->file_descriptor() : -1;
  return lcm_get_fileno(lcm_);
}

int64_t LcmBus::dropped() const { return udpm_ ? udpm_->dropped() : 0; }

void LcmBus::receive() {
  if (!is_udpm_) {
    while (lcm_handle_timeout(lcm_, 0) > 0) {
    }
    return;
  }
  if (!udpm_) return;
  for (const LcmMessage& message : udpm_->take()) {
    for (const auto& subscription : subscriptions_) {
      if (subscription->pattern.matches(message.channel)) {
        subscription->receiver(message.channel, message.bytes);
      }
    }
  }
}

}  // namespace foresight
