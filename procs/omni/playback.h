// When a device that moves by itself moves: from its start delay on, as soon as it may engage. When
// it no longer may, it lets go and stands still; when it may again, it waits for the delay once
// more and goes on, if it is one that resumes.
//
//   Playback playback(1.0, true);
//   playback.allow(may_engage);
//   playback.update(now);
//   if (playback.is_running()) move to playback.time_s();
#pragma once

#include <algorithm>
#include <optional>

#include "common/time.h"

namespace foresight {

class Playback {
 public:
  Playback(double start_delay_s, bool resumes)
      : delay_(seconds(start_delay_s)), resumes_(resumes) {}

  void allow(bool may_engage) { may_engage_ = may_engage; }
  /// `now` never goes back.
  void update(Time now) {
    if (!last_) {
      last_ = now;
      due_ = now + delay_;
    }
    if (is_running_ && !may_engage_) is_interrupted_ = true;
    if (is_interrupted_ && !may_engage_) due_ = now + delay_;
    const bool is_over = is_interrupted_ && !resumes_;
    // One reading later, so that the clutch is seen let go first.
    is_running_ = may_engage_ && was_allowed_ && now >= due_ && !is_over;
    was_allowed_ = may_engage_;
    if (is_running_) progress_ = progress_ + (now - std::max(due_, *last_));
    last_ = now;
  }
  bool is_running() const { return is_running_; }
  /// Interrupted for good.
  bool is_stopped() const { return is_interrupted_ && !resumes_; }
  /// Of the motion, from 0 on.
  double time_s() const { return progress_.seconds(); }

 private:
  Duration delay_;
  bool resumes_;
  bool may_engage_ = true, was_allowed_ = false, is_running_ = false, is_interrupted_ = false;
  std::optional<Time> last_;
  Time due_;
  Duration progress_{0};
};

}  // namespace foresight
