// How often a stream comes, and for how long it has been silent; what a delay is, and what it was
// of late. No bus and no clock in here: arrivals are those of the receiver's clock.
#pragma once

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "common/time.h"

namespace foresight {

/// "0.62 s"
inline std::string seconds_text(Duration duration, int decimals) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*f s", decimals, duration.seconds());
  return text;
}

/// The value below which a share of them lies; 0 of none.
inline Duration quantile(const std::deque<Duration>& values, double share) {
  if (values.empty()) return {};
  std::vector<Duration> sorted(values.begin(), values.end());
  const auto size = static_cast<double>(sorted.size());
  const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(share * size);
  std::nth_element(sorted.begin(), at, sorted.end());
  return *at;
}
inline Duration median(const std::deque<Duration>& values) { return quantile(values, 0.5); }

class StreamWatch {
 public:
  void arrive(Time now) {
    if (last_ && now > *last_) intervals_.push_back(now - *last_);
    if (intervals_.size() > kKept) intervals_.pop_front();
    last_ = now;
  }
  /// Between two messages: the median of the last ones; 0 before the second.
  Duration usual_interval() const { return median(intervals_); }
  /// Since the last message; nothing before the first.
  std::optional<Duration> silence(Time now) const {
    if (!last_) return std::nullopt;
    return std::max(Duration{}, now - *last_);
  }
  /// The clock shows less than at the last message: nothing is known until the next.
  bool is_clock_set_back(Time now) const { return last_ && now < *last_; }
  /// Silent for longer than its usual interval and `slack`. Not before the first message.
  bool is_silent(Time now, Duration slack) const {
    return last_ && now - *last_ > usual_interval() + slack;
  }

 private:
  static constexpr size_t kKept = 15;
  std::optional<Time> last_;
  std::deque<Duration> intervals_;
};

/// A latency that has suddenly become another: a link that stalls, or a clock that was set. Which
/// of the two shows later, if at all; until then nobody should reckon with it.
class LatencyJump {
 public:
  void add(Time now, Duration latency) {
    const Duration more = latency - usual_;
    if (has_usual_ && std::abs(more.us) <= kJump.us) {
      usual_ = usual_ + Duration{more.us / 16};
      is_jump_ = false;
      return;
    }
    if (!is_jump_ || now < since_) since_ = now;
    is_jump_ = has_usual_ && now - since_ < kSettled;
    by_ = more;
    if (is_jump_) return;
    usual_ = latency;
    has_usual_ = true;
  }
  /// By how much it has grown; nothing while it is as usual, or has been so for long enough.
  std::optional<Duration> jump() const { return is_jump_ ? std::optional(by_) : std::nullopt; }

 private:
  static constexpr Duration kJump = milliseconds(500), kSettled = seconds(4);
  bool has_usual_ = false, is_jump_ = false;
  Duration usual_, by_;
  Time since_;
};

/// Of one second after the other: the median delay, and the median of the last minute's. Of a
/// second whose messages contradict each other, or come from the future, nothing is learnt: some
/// are forged.
class DelayWatch {
 public:
  void measure(Duration delay) { of_this_second_.push_back(delay); }
  void end_second() {
    if (of_this_second_.empty()) {
      current_.reset();
      return;
    }
    if (current_ && is_credible_) history_.push_back(*current_);
    if (history_.size() > kHistory) history_.pop_front();
    current_ = median(of_this_second_);
    const Duration spread = quantile(of_this_second_, 0.75) - quantile(of_this_second_, 0.25);
    is_credible_ = current_->us > 0 && spread <= kSpread + Duration{current_->us / 2};
    of_this_second_.clear();
  }
  /// Of the last whole second; nothing when nothing was measured in it.
  std::optional<Duration> current() const { return current_; }
  /// Of the seconds before that; nothing while there are too few.
  std::optional<Duration> normal() const {
    if (history_.size() < kLeast) return std::nullopt;
    return median(history_);
  }

 private:
  static constexpr size_t kHistory = 60, kLeast = 5;
  static constexpr Duration kSpread = milliseconds(100);
  std::deque<Duration> of_this_second_, history_;
  std::optional<Duration> current_;
  bool is_credible_ = false;  // current_
};

}  // namespace foresight
