// What is known of every process, from the HEALTH and LINK_STATS messages heard so far.
//
//   HealthTable table;
//   table.add(now, health);                       // as messages arrive
//   for (const ProcessRow& row : table.rows(now)) …
//   if (table.missing({"slam", "link"}, Wanted::kOk, now).empty()) …
//
// The same message may arrive twice, directly and later through the link: only newer ones count.
// LCM authenticates nobody, so whatever is heard is bounded: names beyond `kMaxNames` replace those
// that are gone or are passed over, and a stamp that lies ahead hides a process for 2 s at most.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/time.h"
#include "foresight/health_t.hpp"
#include "foresight/link_stats_t.hpp"

namespace foresight {

/// Rows of the table, and flows of the link.
constexpr size_t kMaxNames = 256;

/// A process that has not reported for so long is shown as GONE.
constexpr Duration kGoneAfter = seconds(3);

struct ProcessRow {
  health_t health;  // the last one
  Duration age;     // since it was heard
  bool is_gone = false;
  int restarts = 0;           // since this table began: its pid changed
  std::string state() const;  // OK, WAITING, … or GONE
};

enum class Wanted : uint8_t {
  kAlive,  // it reports, whatever its state
  kOk,     // its state is OK, or DONE
};

class HealthTable {
 public:
  void add(Time now, const health_t& health);
  void add(Time now, const link_stats_t& stats);

  /// Ordered by name.
  std::vector<ProcessRow> rows(Time now) const;
  /// Ordered by direction and channel.
  std::vector<link_flow_t> flows() const;
  /// One "name (why)" for each that is not as wanted; empty when all are.
  std::vector<std::string> missing(const std::vector<std::string>& names, Wanted wanted,
                                   Time now) const;

 private:
  struct Entry {
    health_t health;
    Time heard;
    int restarts = 0;
  };
  ProcessRow row(const Entry& entry, Time now) const;
  bool make_room(Time now);

  std::map<std::string, Entry> entries_;
  std::map<std::pair<bool, std::string>, link_flow_t> flows_;
  int64_t stats_utime_ = 0;
  std::optional<Time> stats_heard_;
};

}  // namespace foresight
