#include "procs/link/process.h"

#include <algorithm>
#include <sstream>

#include "common/realtime.h"

namespace foresight {
namespace {

constexpr int kRealtimePriority = 10;  // below a robot's control loops

}  // namespace

LinkProcess::LinkProcess(Node& node, const LinkParams& params)
    : node_(node),
      realtime_(params.realtime),
      to_operator_(params.to_operator, static_cast<uint32_t>(params.seed)),
      to_robot_(params.to_robot, static_cast<uint32_t>(params.seed) + 1) {
  for (Domain domain : {Domain::kRobot, Domain::kOperator}) {
    stats_.push_back(node.advertise<link_stats_t>(
        {.channel = "LINK_STATS", .domain = domain, .rate_hz = 1, .doc = "what the link did"}));
  }
  connect(params.to_operator_channels, Domain::kRobot, &to_operator_);
  connect(params.to_robot_channels, Domain::kOperator, &to_robot_);
  node.every(seconds(1), "stats", [this] { publish_stats(); });
  node.at(node.now(), [this] { node_.set_state(ProcessState::kOk, ""); });
}

void LinkProcess::start() {
  if (node_.is_simulated()) return;
  const bool permitted = realtime_ && schedule_in_real_time(kRealtimePriority);
  node_.set_metric("realtime", permitted ? 1 : 0);
}

void LinkProcess::connect(const std::string& channels, Domain from, Shaper* shaper) {
  const Domain to = from == Domain::kRobot ? Domain::kOperator : Domain::kRobot;
  std::istringstream words(channels);
  for (std::string channel; words >> channel;) {
    Flow& flow = flows_.emplace_back();
    flow.channel = channel;
    flow.shaper = shaper;
    flow.to_operator = to == Domain::kOperator;
    flow.output = node_.advertise_raw({.channel = channel, .domain = to, .doc = "passed on"});
    node_.subscribe_raw({.channel = channel, .domain = from, .doc = "to pass on"}, Queue::kAll,
                        [this, f = &flow](auto bytes) { on_message(f, bytes); });
  }
}

void LinkProcess::on_message(Flow* flow, std::span<const uint8_t> bytes) {
  const Time arrival = node_.now();
  const auto plan = flow->shaper->admit(arrival, bytes.size());
  if (!plan) {
    ++(flow->shaper->last_drop() == ShaperDrop::kLost ? flow->lost : flow->rate_dropped);
    return;
  }
  ++flow->queued;
  std::vector<uint8_t> copy(bytes.begin(), bytes.end());
  const int64_t sequence = ++flow->sequence;
  node_.at(plan->departure, [this, flow, copy = std::move(copy), arrival, planned = plan->departure,
                             sequence] { depart(flow, copy, arrival, planned, sequence); });
}

void LinkProcess::depart(Flow* flow, const std::vector<uint8_t>& bytes, Time arrival, Time planned,
                         int64_t sequence) {
  node_.publish_raw(flow->output, bytes);
  --flow->queued;
  ++flow->forwarded;
  if (sequence < flow->newest_sent) ++flow->reordered;
  flow->newest_sent = std::max(flow->newest_sent, sequence);
  flow->delay_sum = flow->delay_sum + (node_.now() - arrival);
  ++flow->delay_count;
  flow->worst_error = std::max(flow->worst_error, node_.now() - planned);
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
