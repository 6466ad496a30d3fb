// Whether a message's stamp can be taken at the border: one that lies in the future of the
// receiver's clock is either a forgery, an accident, or the stream of a sender whose clock runs
// ahead (another machine; recorded video with its own stamps). The stream that keeps coming wins
// (docs/decisions/0008): a stamp in the future is taken when it goes on a stream that is stamped
// so, or when nothing else has come for `kSilence`; it never interrupts a stream that arrives.
//
//   if (!gate.accept({message.utime}, node.now())) …    // refuse the message
//
// Stamps in the past are no business of the border: delays, repeated states and old recordings have
// them. Pure; one for each port.
#pragma once

#include <algorithm>

#include "common/time.h"

namespace foresight {

class StampGate {
 public:
  static constexpr Duration kTolerance = seconds(1);
  static constexpr Duration kSilence = seconds(1);
  /// A stream that lives by another clock may jump ahead by as much: a recording has gaps.
  static constexpr Duration kGapOfARecording = seconds(3600);
  /// What is not older than this lives by the receiver's clock, whatever came before it.
  static constexpr Duration kPresent = seconds(60);

  /// Both instants must be plausible ones (message_check.h): their difference does not overflow.
  [[nodiscard]] bool accept(Time stamp, Time now) {
    const Duration lead = stamp - now;
    const bool is_alive = has_begun_ && now >= arrival_ && now - arrival_ < kSilence;
    const Duration jump = lead_ > kTolerance ? kGapOfARecording : kTolerance;
    if (is_alive && lead > std::max(lead_, Duration{0}) + jump) return false;
    const bool is_present = lead <= kTolerance && lead > Duration{0} - kPresent;
    if (!is_alive || is_present || lead >= lead_ - kTolerance) {
      has_begun_ = true;
      lead_ = lead;
      arrival_ = now;
    }
    return true;
  }

 private:
  bool has_begun_ = false;
  Duration lead_;  // of the stream that arrives, over the receiver's clock
  Time arrival_;   // of its newest message
};

}  // namespace foresight
