#include "procs/top/health_table.h"

namespace foresight {

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

void HealthTable::add(Time now, const health_t& health) {
  const auto found = entries_.find(health.process);
  if (found == entries_.end()) {
    entries_[health.process] = {health, now};
    return;
  }
  Entry& entry = found->second;
  // A process that comes back after a silence is believed even if its clock was set back.
  if (health.utime <= entry.health.utime && now - entry.heard <= kGoneAfter) return;
  if (health.pid != entry.health.pid) ++entry.restarts;
  entry.health = health;
  entry.heard = now;
}

void HealthTable::add(const link_stats_t& stats) {
  if (stats.utime < stats_utime_) return;
  stats_utime_ = stats.utime;
  for (const link_flow_t& flow : stats.flows) flows_[{flow.to_operator != 0, flow.channel}] = flow;
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
