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
/// It passes bytes without reading them: names and time-stamps are the same on both sides.
class LinkProcess : public Process {
 public:
  using Params = LinkParams;
  static constexpr ProcessInfo kInfo{
      "link", "Passes channels between the two sites with a shaped delay.", Domain::kRobot, true};

  LinkProcess(Node& node, const LinkParams& params);
  void start() override;

 private:
  struct Flow {
    std::string channel;
    Shaper* shaper = nullptr;
    bool to_operator = false;
    PortRecord* output = nullptr;
    int64_t forwarded = 0, lost = 0, rate_dropped = 0, reordered = 0, sequence = 0, newest_sent = 0;
    int32_t queued = 0;
    // Of the last second.
    Duration delay_sum{0}, worst_error{0};
    int64_t delay_count = 0;
  };
  void connect(const std::string& channels, Domain from, Shaper* shaper);
  void on_message(Flow* flow, std::span<const uint8_t> bytes);
  void depart(Flow* flow, const std::vector<uint8_t>& bytes, Time arrival, Time planned,
              int64_t sequence);
  void publish_stats();

  Node& node_;
  bool realtime_;
  Shaper to_operator_, to_robot_;
  std::deque<Flow> flows_;  // addresses stay valid
  std::vector<Publisher<link_stats_t>> stats_;
};

}  // namespace foresight
