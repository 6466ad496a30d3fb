// The numbers of joint commands: a session, which is when it began, and a count within it. A
// session never lies in the future and time does not go back in it, or its commands would be
// refused: so another one begins when the clock is before its beginning (stamped from the wall
// clock before a simulated world had told its time), and when the clock has been set back.
#pragma once

#include <cstdint>

#include "common/time.h"

namespace foresight {

class CommandSession {
 public:
  void begin(Time now) {
    session_ = now.us;
    seq_ = 0;
    last_ = now;
  }
  /// Before each command. True: another session has begun.
  bool update(Time now) {
    const bool is_over = now.us < session_ || now < last_ - kStepBack;
    if (is_over) begin(now);
    last_ = now;
    return is_over;
  }
  int64_t session() const { return session_; }
  int64_t next_seq() { return ++seq_; }

 private:
  static constexpr Duration kStepBack = seconds(1.0);
  int64_t session_ = 0, seq_ = 0;
  Time last_;
};

}  // namespace foresight
