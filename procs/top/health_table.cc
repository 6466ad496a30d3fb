#include "procs/top/health_table.h"

#include <algorithm>

namespace foresight {
namespace {

// Everybody reports once a second; whose newest report is older than this may have been forged.
constexpr Duration kBelievedAfter = seconds(2);

}  // namespace

std::string ProcessRow::state() const {
  if (is_gone) return "GONE";
  switch (health.state) {
    case health_t::STATE_STARTING:
      return "STARTING";
    case health_t::STATE_OK:
      return "OK";
    case health_t::STATE_WAITING:
      return "WAITING";
    case health_t::STATE_DEGRADED:
      return "DEGRADED";
    case health_t::STATE_FAILED:
      return "FAILED";
    case health_t::STATE_DONE:
      return "DONE";
    default:
      return "state " + std::to_string(health.state);
  }
}

// True when another process has a place in the table, perhaps that of one that is gone.
bool HealthTable::make_room(Time now) {
  if (entries_.size() < kMaxNames) return true;
  const auto oldest = std::min_element(
      entries_.begin(), entries_.end(),
      [](const auto& a, const auto& b) { return a.second.heard < b.second.heard; });
  if (now - oldest->second.heard <= kGoneAfter) return false;
  entries_.erase(oldest);
  return true;
}

void HealthTable::add(Time now, const health_t& health) {
  const auto found = entries_.find(health.process);
  if (found == entries_.end()) {
    if (make_room(now)) entries_[health.process] = {health, now};
    return;
  }
  Entry& entry = found->second;
  // A process that comes back after a silence is believed even if its clock was set back.
  if (health.utime <= entry.health.utime && now - entry.heard < kBelievedAfter) return;
  if (health.pid != entry.health.pid) ++entry.restarts;
  entry.health = health;
  entry.heard = now;
}

void HealthTable::add(Time now, const link_stats_t& stats) {
  const bool is_alive = stats_heard_ && now - *stats_heard_ < kBelievedAfter;
  if (stats.utime < stats_utime_ && is_alive) return;
  stats_utime_ = stats.utime;
  stats_heard_ = now;
  for (const link_flow_t& flow : stats.flows) {
    const std::pair key{flow.to_operator != 0, flow.channel};
    if (flows_.size() < kMaxNames || flows_.contains(key)) flows_[key] = flow;
  }
}

ProcessRow HealthTable::row(const Entry& entry, Time now) const {
  const Duration age = now - entry.heard;
  return {entry.health, age, age > kGoneAfter, entry.restarts};
}

std::vector<ProcessRow> HealthTable::rows(Time now) const {
  std::vector<ProcessRow> rows;
  for (const auto& [name, entry] : entries_) rows.push_back(row(entry, now));
  return rows;
}

std::vector<link_flow_t> HealthTable::flows() const {
  std::vector<link_flow_t> flows;
  for (const auto& [key, flow] : flows_) flows.push_back(flow);
  return flows;
}

std::vector<std::string> HealthTable::missing(const std::vector<std::string>& names, Wanted wanted,
                                              Time now) const {
  std::vector<std::string> missing;
  for (const std::string& name : names) {
    const auto found = entries_.find(name);
    if (found == entries_.end()) {
      missing.push_back(name + " (no health heard)");
      continue;
    }
    const ProcessRow r = row(found->second, now);
    const bool fine =
        r.health.state == health_t::STATE_OK || r.health.state == health_t::STATE_DONE;
    if (r.is_gone || (wanted == Wanted::kOk && !fine)) {
      const std::string& reason = r.health.reason;
      missing.push_back(name + " (" + r.state() + (reason.empty() ? "" : ": " + reason) + ")");
    }
  }
  return missing;
}

}  // namespace foresight
