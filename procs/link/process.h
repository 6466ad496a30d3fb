#pragma once

#include <array>
#include <deque>
#include <string>
#include <vector>

#include "common/node.h"
#include "common/process_main.h"
#include "foresight/link_stats_t.hpp"
#include "procs/link/params.h"
#include "procs/link/shaper.h"

namespace foresight {

/// Connects the two sites with a shaped delay, loss, order and rate (the paper's channel, §II-D).
/// It passes bytes without reading them: names and time-stamps are the same on both sides. What is
/// under way is bounded in memory; beyond it, messages are dropped as they arrive, and health says
/// so.
class LinkProcess : public Process {
 public:
  using Params = LinkParams;
  static constexpr ProcessInfo kInfo{
      "link", "Passes channels between the two sites with a shaped delay.", Domain::kRobot, true};

  LinkProcess(Node& node, const LinkParams& params);
  void start() override;

 private:
  struct Flow;
  struct Message {
    Flow* flow = nullptr;
    std::vector<uint8_t> bytes;
    Time arrival, planned;
    int64_t sequence = 0;  // within the flow
  };
  struct Direction {
    Direction(std::string name_in, const ShaperOptions& options, uint32_t seed)
        : name(std::move(name_in)), shaper(options, seed) {}
    std::string name;
    Shaper shaper;
    std::deque<Message> in_order;  // under way, by departure
    int64_t departed = 0;          // of in_order, since the start
    int64_t waiting_bytes = 0;     // of all that is under way
    int64_t overflowed = 0;
    Time overflowed_at;
  };
  struct Flow {
    std::string channel;
    Direction* direction = nullptr;
    bool to_operator = false;
    PortRecord* output = nullptr;
    int64_t forwarded = 0, lost = 0, rate_dropped = 0, reordered = 0, sequence = 0, newest_sent = 0;
    int32_t queued = 0;
    // Of the last second.
    Duration delay_sum{0}, worst_error{0};
    int64_t delay_count = 0;
  };
  void connect(const std::vector<std::string>& channels, Domain from, Direction* direction);
  void on_message(Flow* flow, std::span<const uint8_t> bytes);
  bool overflows(Direction* direction, size_t bytes);
  void depart_in_order(Direction* direction, int64_t count);
  void depart(Direction* direction, const Message& message);
  void watch();
  void report();
  void publish_stats();

  Node& node_;
  LinkParams params_;
  Direction to_operator_, to_robot_;
  std::deque<Flow> flows_;  // addresses stay valid
  std::vector<Publisher<link_stats_t>> stats_;
  Time watched_at_, stalled_at_;
  Duration stall_{0};
  int64_t clock_changes_ = 0;
};

}  // namespace foresight
