#include "common/udpm_receiver.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <utility>

#include "common/errors.h"

namespace foresight {
namespace {

constexpr size_t kLargestDatagram_bytes = 65536;
constexpr size_t kMessageCost_bytes = 256;  // of one that waits, beside its bytes
constexpr int kDatagramsInARow = 256;       // then it looks whether it shall stop

int64_t monotonic_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

template <class Number>
std::optional<Number> read_number(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

// The value of `key` in "a=1&b=2".
std::string_view find_option(std::string_view options, std::string_view key) {
  while (!options.empty()) {
    const std::string_view option = options.substr(0, options.find('&'));
    options.remove_prefix(std::min(options.size(), option.size() + 1));
    if (option.starts_with(key) && option.substr(key.size()).starts_with("=")) {
      return option.substr(key.size() + 1);
    }
  }
  return {};
}

[[noreturn]] void fail(const char* what) {
  throw UnavailableError(std::string("LCM: cannot ") + what + ": " + std::strerror(errno) +
                         " (run scripts/setup --network)");
}

void signal_event(int event) {
  const uint64_t one = 1;
  [[maybe_unused]] const auto n = write(event, &one, sizeof one);
}

size_t cost(const LcmMessage& message) { return message.bytes.size() + kMessageCost_bytes; }

}  // namespace

std::optional<UdpmAddress> parse_udpm_url(const std::string& url) {
  constexpr std::string_view kScheme = "udpm://";
  std::string_view rest = url;
  if (!rest.starts_with(kScheme)) return std::nullopt;
  rest.remove_prefix(kScheme.size());
  const std::string_view network = rest.substr(0, rest.find('?'));
  rest.remove_prefix(std::min(rest.size(), network.size() + 1));
  const size_t colon = network.find(':');
  if (colon == std::string_view::npos) return std::nullopt;
  in_addr group{};
  const auto port = read_number<uint16_t>(network.substr(colon + 1));
  const bool is_address =
      inet_pton(AF_INET, std::string(network.substr(0, colon)).c_str(), &group) == 1;
  if (!is_address || !IN_MULTICAST(ntohl(group.s_addr)) || !port || *port == 0) return std::nullopt;
  const auto buffer = read_number<int>(find_option(rest, "recv_buf_size"));
  return UdpmAddress{ntohl(group.s_addr), *port, buffer.value_or(0)};
}

UdpmReceiver::UdpmReceiver(const UdpmAddress& address)
    : event_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)),
      stop_event_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)),
      datagram_(kLargestDatagram_bytes) {
  try {
    open_socket(address);
  } catch (...) {
    close_all();
    throw;
  }
  thread_ = std::thread([this] { loop(); });
}

UdpmReceiver::~UdpmReceiver() {
  signal_event(stop_event_);
  thread_.join();
  close_all();
}

void UdpmReceiver::close_all() {
  for (const int fd : {socket_, event_, stop_event_}) {
    if (fd >= 0) close(fd);
  }
}

void UdpmReceiver::open_socket(const UdpmAddress& address) {
  socket_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket_ < 0) fail("open a socket");
  const int on = 1;
  if (setsockopt(socket_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0) fail("share its port");
  if (address.buffer_bytes > 0) {  // the kernel caps it: LcmBus::complaint() says so
    setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &address.buffer_bytes, sizeof address.buffer_bytes);
  }
  sockaddr_in here{};
  here.sin_family = AF_INET;
  here.sin_port = htons(address.port);
  here.sin_addr.s_addr = htonl(address.group);
  if (bind(socket_, reinterpret_cast<const sockaddr*>(&here), sizeof here) != 0) {
    fail("listen at its port");
  }
  ip_mreq membership{};
  membership.imr_multiaddr.s_addr = htonl(address.group);
  membership.imr_interface.s_addr = htonl(INADDR_ANY);
  if (setsockopt(socket_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0) {
    fail("join its multicast group");
  }
}

void UdpmReceiver::listen_to(const ChannelPattern& pattern) {
  std::lock_guard lock(mutex_);
  patterns_.push_back(pattern);
}

void UdpmReceiver::loop() {
  while (true) {
    pollfd fds[] = {{socket_, POLLIN, 0}, {stop_event_, POLLIN, 0}};
    if (poll(fds, 2, -1) < 0 && errno != EINTR) return;
    if (fds[1].revents != 0) return;
    receive_some();
  }
}

void UdpmReceiver::receive_some() {
  for (int i = 0; i < kDatagramsInARow; ++i) {
    sockaddr_in from{};
    socklen_t from_size = sizeof from;
    const ssize_t size = recvfrom(socket_, datagram_.data(), datagram_.size(), 0,
                                  reinterpret_cast<sockaddr*>(&from), &from_size);
    if (size < 0) return;
    const uint64_t sender = uint64_t{ntohl(from.sin_addr.s_addr)} << 16 | ntohs(from.sin_port);
    auto message =
        assembler_.feed(sender, {datagram_.data(), static_cast<size_t>(size)}, monotonic_us());
    malformed_ = assembler_.malformed();
    if (message) keep(*std::move(message));
  }
}

void UdpmReceiver::keep(LcmMessage message) {
  {
    std::lock_guard lock(mutex_);
    const bool is_wanted = std::any_of(patterns_.begin(), patterns_.end(),
                                       [&](const auto& p) { return p.matches(message.channel); });
    if (!is_wanted) return;
    waiting_bytes_ += cost(message);
    waiting_.push_back(std::move(message));
    for (; waiting_bytes_ > kWaiting_bytes; ++dropped_) {
      waiting_bytes_ -= cost(waiting_.front());
      waiting_.pop_front();
    }
  }
  signal_event(event_);
}

std::deque<LcmMessage> UdpmReceiver::take() {
  uint64_t count = 0;
  [[maybe_unused]] const auto n = read(event_, &count, sizeof count);
  std::lock_guard lock(mutex_);
  waiting_bytes_ = 0;
  return std::exchange(waiting_, {});
}

}  // namespace foresight
