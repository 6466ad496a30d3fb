// When a world that runs at its own pace may take its next tick: never faster than `speed` times
// the wall clock, not before the controller has answered the last tick (for at most 20 ms of wall
// time), and not while a camera frame is late. A loaded machine makes it slower, not wrong.
//
//   Pacer pacer(1.0, kTick);
//   while (pacer.may_tick(wall_now, frame_is_missing)) { pacer.on_tick(wall_now); ... }
//   pacer.on_torques(answers_the_last_tick);   // whenever the controller sends some
//
// A controller that has left many ticks unanswered is not waited for until it answers again.
#pragma once

#include <algorithm>
#include <cstdint>

#include "common/time.h"

namespace foresight::sim {

class Pacer {
 public:
  Pacer(double speed, Duration tick) : speed_(speed), tick_(tick) {}

  bool may_tick(Time wall_now, bool frame_is_missing) {
    earn(wall_now);
    if (frame_is_missing || credit_us_ < static_cast<double>(tick_.us)) return false;
    const bool patient = !is_answered_ && unanswered_in_a_row_ < kPatience;
    return !patient || wall_now - last_tick_ >= kLongestWait;
  }
  void on_tick(Time wall_now) {
    credit_us_ -= static_cast<double>(tick_.us);
    if (!is_answered_) {
      ++unanswered_in_a_row_;
      if (has_been_answered_) ++unanswered_;
    }
    is_answered_ = false;
    last_tick_ = wall_now;
  }
  void on_torques(bool answers_the_last_tick) {
    if (answers_the_last_tick) is_answered_ = true;
    has_been_answered_ = true;
    unanswered_in_a_row_ = 0;
  }
  /// Ticks taken without an answer, since the first answer.
  int64_t unanswered() const { return unanswered_; }

 private:
  static constexpr Duration kLongestWait = milliseconds(20);
  static constexpr Duration kLongestDebt = milliseconds(20);  // of wall time, made up for later
  static constexpr int64_t kPatience = 25;                    // ticks

  void earn(Time wall_now) {
    if (has_begun_) {
      const double passed_us = speed_ * static_cast<double>((wall_now - last_look_).us);
      const double most_us =
          std::max(speed_ * static_cast<double>(kLongestDebt.us), static_cast<double>(tick_.us));
      credit_us_ = std::min(credit_us_ + std::max(passed_us, 0.0), most_us);
    }
    has_begun_ = true;
    last_look_ = wall_now;
  }

  double speed_;
  Duration tick_;
  double credit_us_ = 0;  // of simulated time that may pass
  bool has_begun_ = false, is_answered_ = true, has_been_answered_ = false;
  int64_t unanswered_in_a_row_ = kPatience, unanswered_ = 0;
  Time last_look_, last_tick_;
};

}  // namespace foresight::sim
