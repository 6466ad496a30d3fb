// When the events of a log are replayed. A recorder stamps what it receives, so a log's stamps
// rise; where they do not, somebody stepped the clock or shuffled the file, and neither may stop a
// replay or fill it with hours of nothing.
//
//   const LogTimeline timeline = make_timeline(stamps);
//   for (size_t i = 0; i < stamps.size(); ++i) replay(timeline.order[i], timeline.times[i]);
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/time.h"

namespace foresight {

struct LogTimeline {
  std::vector<size_t> order;  // index of the event that comes i-th
  std::vector<Time> times;    // when it does; falls by at most kTolerated
  int64_t late = 0;           // events stamped earlier than the one before them in the log …
  int64_t far_late = 0;       // … by more than kTolerated
  int64_t leaps = 0;          // forward by more than kLongestPause
  Duration farthest{0};       // of the late ones
  bool is_sorted = false;     // shuffled: the order is that of the stamps

  /// Events that two threads of a recorder stamped are out of order by so much at most.
  static constexpr Duration kTolerated = seconds(1);
  /// Nobody leaves a recorder running through a longer silence; a stepped clock looks like that.
  static constexpr Duration kLongestPause = seconds(3600);

  /// One line about stamps that do not rise as a recorder's do; empty when all do.
  std::string remark() const;
  /// What was replayed cannot be what happened. (A leap alone may be a long silence.)
  bool is_out_of_order() const { return far_late > 0; }
};

/// Few backward steps: the clock was stepped. Events keep their order and their spacing, and each
/// step takes no time; the longest stretch keeps its stamps. Many (more than 1 in 100): the log was
/// shuffled, and events come in the order of their stamps. O(n log n).
LogTimeline make_timeline(const std::vector<Time>& stamps);

}  // namespace foresight
