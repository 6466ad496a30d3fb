// Which orders have been given, and what became of them: an order that comes again (it was lost on
// the way, or took two ways) is answered again and not done again. Of bounded size.
#pragma once

#include <algorithm>
#include <compare>
#include <cstdint>
#include <deque>
#include <string>
#include <utility>

namespace foresight {

struct Order {
  int64_t utime = 0;
  int command = 0;
  std::string map_name;
  auto operator<=>(const Order&) const = default;
};

enum class OrderOutcome : int8_t { kRefused, kDone, kRunning };

struct OrderAnswer {
  OrderOutcome outcome = OrderOutcome::kRefused;
  std::string text;
};

class OrderBook {
 public:
  /// The newest answer to this very order; nothing when it is new (or long ago).
  const OrderAnswer* find(const Order& order) const {
    const auto it = std::find_if(entries_.begin(), entries_.end(),
                                 [&](const auto& entry) { return entry.first == order; });
    return it == entries_.end() ? nullptr : &it->second;
  }
  void note(const Order& order, OrderAnswer answer) {
    std::erase_if(entries_, [&](const auto& entry) { return entry.first == order; });
    entries_.emplace_back(order, std::move(answer));
    if (entries_.size() > kRemembered) entries_.pop_front();
  }

 private:
  static constexpr size_t kRemembered = 64;
  std::deque<std::pair<Order, OrderAnswer>> entries_;
};

}  // namespace foresight
