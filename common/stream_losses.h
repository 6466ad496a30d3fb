// How many messages of a numbered stream never arrived. A number that goes back a little came late
// and is no loss; one that goes back or forward by more than anybody loses at once belongs to a
// source that began anew (or is absurd) and counts nothing.
//
//   losses.add({.source = message.session, .number = message.seq}, skipped_so_far);
#pragma once

#include <cstdint>

namespace foresight {

struct StreamNumber {
  int64_t source = 0;  // counts by itself: another source begins anew
  int64_t number = 0;
};

class StreamLosses {
 public:
  /// A jump beyond this is no loss.
  static constexpr int64_t kMostAtOnce = 10'000;

  /// `skipped`: messages of the stream that arrived and were passed over, since the start.
  void add(StreamNumber n, int64_t skipped) {
    const int64_t passed_over = skipped - skipped_;
    skipped_ = skipped;
    int64_t jump = 0;
    const bool goes_on = has_begun_ && n.source == newest_.source &&
                         !__builtin_sub_overflow(n.number, newest_.number, &jump) &&
                         jump > -kMostAtOnce && jump < kMostAtOnce;
    if (goes_on && jump <= 0 && jump > -kLate) {  // late, or the same once more
      if (jump < 0 && lost_ > 0) --lost_;
      return;
    }
    if (goes_on && jump > 1 + passed_over) lost_ += jump - 1 - passed_over;
    has_begun_ = true;
    newest_ = n;
  }
  int64_t lost() const { return lost_; }

 private:
  static constexpr int64_t kLate = 16;

  bool has_begun_ = false;
  StreamNumber newest_;
  int64_t skipped_ = 0, lost_ = 0;
};

}  // namespace foresight
