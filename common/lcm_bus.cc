#include "common/lcm_bus.h"

#include <lcm/lcm.h>

#include <cstdlib>
#include <fstream>

#include "common/errors.h"

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

LcmBus::LcmBus(const std::string& url) {
  lcm_ = lcm_create(url.c_str());
  if (lcm_ == nullptr) {
    throw UnavailableError("LCM " + url +
                           " cannot be opened: bad URL, or no multicast route on this host (run "
                           "scripts/setup --network)");
  }
  complaint_ = find_buffer_complaint(url);
}

LcmBus::~LcmBus() { lcm_destroy(lcm_); }

void LcmBus::subscribe(const std::string& channel, Receiver receiver) {
  subscriptions_.push_back(std::make_unique<Subscription>(Subscription{std::move(receiver)}));
  const auto on_message = [](const lcm_recv_buf_t* buffer, const char* name, void* user) {
    static_cast<Subscription*>(user)->receiver(
        name, {static_cast<const uint8_t*>(buffer->data), buffer->data_size});
  };
  lcm_subscription_t* subscription =
      lcm_subscribe(lcm_, channel.c_str(), on_message, subscriptions_.back().get());
  // The library would drop the newest of 30; the host has queues of its own.
  lcm_subscription_set_queue_capacity(subscription, 0);
}

void LcmBus::publish(const std::string& channel, std::span<const uint8_t> bytes) {
  lcm_publish(lcm_, channel.c_str(), bytes.data(), static_cast<unsigned>(bytes.size()));
}

int LcmBus::file_descriptor() const { return lcm_get_fileno(lcm_); }

void LcmBus::receive() {
  while (lcm_handle_timeout(lcm_, 0) > 0) {
  }
}

}  // namespace foresight
