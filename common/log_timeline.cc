#include "common/log_timeline.h"

#include <algorithm>
#include <cstdio>
#include <numeric>

namespace foresight {
namespace {

constexpr size_t kFewSteps = 3;

void count_late(const std::vector<Time>& stamps, LogTimeline* timeline) {
  for (size_t i = 1; i < stamps.size(); ++i) {
    const Duration behind = stamps[i - 1] - stamps[i];
    if (behind > Duration{0}) ++timeline->late;
    if (behind > LogTimeline::kTolerated) ++timeline->far_late;
    timeline->farthest = std::max(timeline->farthest, behind);
  }
}

bool is_step(Duration forward) {
  return forward < Duration{-LogTimeline::kTolerated.us} || forward > LogTimeline::kLongestPause;
}

// Takes the steps out of the times, which are stamps in the order of replay.
void close_steps(LogTimeline* timeline) {
  std::vector<Time>& times = timeline->times;
  Duration shift{0}, shift_of_longest{0};
  size_t begin = 0, longest = 0;
  for (size_t i = 1; i <= times.size(); ++i) {
    const Duration forward = i < times.size() ? times[i] + shift - times[i - 1] : Duration{0};
    if (i < times.size() && !is_step(forward)) {
      times[i] = times[i] + shift;
      continue;
    }
    if (i - begin > longest) {
      longest = i - begin;
      shift_of_longest = shift;
    }
    if (i == times.size()) break;
    if (forward > Duration{0}) ++timeline->leaps;
    begin = i;
    shift = shift - forward;
    times[i] = times[i] + shift;
  }
  for (Time& time : times) time = time - shift_of_longest;
}

}  // namespace

std::string LogTimeline::remark() const {
  std::string text;
  const auto add = [&](const std::string& what) { text += (text.empty() ? "" : "; ") + what; };
  if (late > 0) {
    char line[160];
    std::snprintf(
        line, sizeof line,
        "%lld of %zu events are stamped earlier than the one before them, by up to %.6f s",
        static_cast<long long>(late), times.size(), farthest.seconds());
    add(line);
  }
  if (leaps > 0) add(std::to_string(leaps) + " leap forward by more than an hour");
  if (is_sorted) {
    add("the log is shuffled: replayed in the order of its stamps");
  } else if (far_late > 0 || leaps > 0) {
    add("the recorder's clock was stepped, or it was silent: replayed without the steps");
  }
  return text;
}

LogTimeline make_timeline(const std::vector<Time>& stamps) {
  LogTimeline timeline;
  timeline.order.resize(stamps.size());
  std::iota(timeline.order.begin(), timeline.order.end(), size_t{0});
  count_late(stamps, &timeline);
  const size_t few = std::max(kFewSteps, stamps.size() / 100);
  timeline.is_sorted = static_cast<size_t>(timeline.far_late) > few;
  if (timeline.is_sorted) {
    std::stable_sort(timeline.order.begin(), timeline.order.end(),
                     [&](size_t a, size_t b) { return stamps[a] < stamps[b]; });
  }
  for (const size_t i : timeline.order) timeline.times.push_back(stamps[i]);
  close_steps(&timeline);
  return timeline;
}

}  // namespace foresight
