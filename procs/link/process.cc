#include "procs/link/process.h"

#include <algorithm>
#include <cstdio>
#include <sstream>
#include <utility>

#include "common/realtime.h"

namespace foresight {
namespace {

constexpr int kRealtimePriority = 10;  // below a robot's control loops
constexpr Duration kWatchPeriod = milliseconds(50);
// The process stood still (stopped, starved) when its watch comes so late.
constexpr Duration kStall = milliseconds(250);
// Stalls and overflows are said in health for so long.
constexpr Duration kNews = seconds(10);
constexpr int64_t kMessageCost_bytes = 256;  // of one under way, beside its bytes

}  // namespace

LinkProcess::LinkProcess(Node& node, const LinkParams& params)
    : node_(node),
      params_(params),
      to_operator_("to_operator", params.to_operator, static_cast<uint32_t>(params.seed)),
      to_robot_("to_robot", params.to_robot, static_cast<uint32_t>(params.seed) + 1) {
  for (Domain domain : {Domain::kRobot, Domain::kOperator}) {
    stats_.push_back(node.advertise<link_stats_t>(
        {.channel = "LINK_STATS", .domain = domain, .rate_hz = 1, .doc = "what the link did"}));
  }
  connect(params.to_operator_channels, Domain::kRobot, &to_operator_);
  connect(params.to_robot_channels, Domain::kOperator, &to_robot_);
  node.every(seconds(1), "stats", [this] {
    report();
    publish_stats();
  });
  node.every(kWatchPeriod, "watch", [this] { watch(); });
  node.at(node.now(), [this] { node_.set_state(ProcessState::kOk, ""); });
}

void LinkProcess::start() {
  watched_at_ = node_.now();
  if (node_.is_simulated()) return;
  const bool permitted = params_.realtime && schedule_in_real_time(kRealtimePriority);
  node_.set_metric("realtime", permitted ? 1 : 0);
}

void LinkProcess::connect(const std::vector<std::string>& channels, Domain from,
                          Direction* direction) {
  const Domain to = from == Domain::kRobot ? Domain::kOperator : Domain::kRobot;
  for (const std::string& channel : channels) {
    Flow& flow = flows_.emplace_back();
    flow.channel = channel;
    flow.direction = direction;
    flow.to_operator = to == Domain::kOperator;
    flow.output = node_.advertise_raw({.channel = channel, .domain = to, .doc = "passed on"});
    node_.subscribe_raw({.channel = channel, .domain = from, .doc = "to pass on"}, Queue::kAll,
                        [this, f = &flow](auto bytes) { on_message(f, bytes); });
  }
}

bool LinkProcess::overflows(Direction* direction, size_t bytes) {
  const auto limit_bytes = static_cast<int64_t>(params_.queue_limit_mb * 1e6);
  if (direction->waiting_bytes + static_cast<int64_t>(bytes) <= limit_bytes) return false;
  ++direction->overflowed;
  direction->overflowed_at = node_.now();
  return true;
}

void LinkProcess::on_message(Flow* flow, std::span<const uint8_t> bytes) {
  Direction* direction = flow->direction;
  if (overflows(direction, bytes.size())) {
    ++flow->rate_dropped;
    return;
  }
  const Time arrival = node_.now();
  const auto plan = direction->shaper.admit(arrival, bytes.size());
  if (!plan) {
    ++(direction->shaper.last_drop() == ShaperDrop::kLost ? flow->lost : flow->rate_dropped);
    return;
  }
  ++flow->queued;
  direction->waiting_bytes += kMessageCost_bytes + static_cast<int64_t>(bytes.size());
  Message message{flow, {bytes.begin(), bytes.end()}, arrival, plan->departure, ++flow->sequence};
  if (plan->reordered) {
    node_.at(plan->departure,
             [this, direction, message = std::move(message)] { depart(direction, message); });
    return;
  }
  direction->in_order.push_back(std::move(message));
  const int64_t count = direction->departed + static_cast<int64_t>(direction->in_order.size());
  node_.at(plan->departure, [this, direction, count] { depart_in_order(direction, count); });
}

// All up to the one whose time has come: whatever the clock did meanwhile, their order is kept.
void LinkProcess::depart_in_order(Direction* direction, int64_t count) {
  while (direction->departed < count) {
    ++direction->departed;
    depart(direction, direction->in_order.front());
    direction->in_order.pop_front();
  }
}

void LinkProcess::depart(Direction* direction, const Message& message) {
  Flow* flow = message.flow;
  node_.publish_raw(flow->output, message.bytes);
  direction->waiting_bytes -= kMessageCost_bytes + static_cast<int64_t>(message.bytes.size());
  --flow->queued;
  ++flow->forwarded;
  if (message.sequence < flow->newest_sent) ++flow->reordered;
  flow->newest_sent = std::max(flow->newest_sent, message.sequence);
  flow->delay_sum = flow->delay_sum + (node_.now() - message.arrival);
  ++flow->delay_count;
  flow->worst_error = std::max(flow->worst_error, node_.now() - message.planned);
}

void LinkProcess::watch() {
  const Duration pause = node_.now() - watched_at_;
  watched_at_ = node_.now();
  const int64_t changes = node_.clock_changes();
  const bool is_another_clock = changes != std::exchange(clock_changes_, changes);
  if (pause < kStall || is_another_clock) return;
  stalled_at_ = node_.now();
  stall_ = pause;
}

void LinkProcess::report() {
  std::string reason;
  const auto add = [&](const std::string& text) { reason += (reason.empty() ? "" : "; ") + text; };
  for (const Direction* d : {&to_operator_, &to_robot_}) {
    if (d->overflowed == 0 || node_.now() - d->overflowed_at > kNews) continue;
    add(d->name + ": more than queue_limit_mb under way, " + std::to_string(d->overflowed) +
        " messages dropped so far");
  }
  if (stall_.us > 0 && node_.now() - stalled_at_ < kNews) {
    char text[64];
    std::snprintf(text, sizeof text, "stood still for %.1f s, %.0f s ago", stall_.seconds(),
                  (node_.now() - stalled_at_).seconds());
    add(text);
  }
  node_.set_state(reason.empty() ? ProcessState::kOk : ProcessState::kDegraded, reason);
}

void LinkProcess::publish_stats() {
  link_stats_t stats{};
  stats.utime = node_.now().us;
  for (Flow& flow : flows_) {
    link_flow_t f{};
    f.channel = flow.channel;
    f.to_operator = flow.to_operator ? 1 : 0;
    f.forwarded = flow.forwarded;
    f.lost = flow.lost;
    f.rate_dropped = flow.rate_dropped;
    f.reordered = flow.reordered;
    f.queued = flow.queued;
    f.delay_ms = static_cast<float>(1e3 * flow.delay_sum.seconds() /
                                    static_cast<double>(std::max<int64_t>(1, flow.delay_count)));
    f.delay_error_ms = static_cast<float>(1e3 * flow.worst_error.seconds());
    stats.flows.push_back(f);
    flow.delay_sum = flow.worst_error = {0};
    flow.delay_count = 0;
  }
  stats.n_flows = static_cast<int32_t>(stats.flows.size());
  for (const auto& publisher : stats_) publisher.publish(stats);
}

}  // namespace foresight
