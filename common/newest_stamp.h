// Which message of a stream is newer than the last, without one absurd message ending the stream
// for good: the stream that keeps coming wins. For every rule "older than the newest: ignored".
//
//   NewestStamp newest;                                    // one per stream
//   switch (newest.judge(node.now(), {message.utime})) {
//     case StampVerdict::kNewer: break;
//     case StampVerdict::kRestarted: forget_the_earlier(); break;
//     default: return input.reject(…);
//   }
//
// Refused at the border: no instant of this age of the world (≤ 0, or from the year 2255 on), and a
// stamp further than `tolerance` in the future of the receiver's clock. An older or a future stamp
// is dropped too, but it is remembered: when `patience` of them have come running over `span`, each
// newer than the last and as late or early as it, they are the stream, and what was newest was a
// forgery, or a clock has been set. Hence a sender whose clock is ahead is heard as well, and so is
// one whose clock runs faster (a recording replayed at speed).
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "common/time.h"

namespace foresight {

enum class StampVerdict : uint8_t {
  kNewer,      // take it
  kRestarted,  // take it, and forget what came before: that was of another stream
  kRepeated,   // the newest once more
  kOld,
  kFuture,
  kAbsurd,
};

inline bool is_taken(StampVerdict verdict) {
  return verdict == StampVerdict::kNewer || verdict == StampVerdict::kRestarted;
}

inline const char* to_string(StampVerdict verdict) {
  switch (verdict) {
    case StampVerdict::kNewer:
      return "newer";
    case StampVerdict::kRestarted:
      return "of a stream that begins anew";
    case StampVerdict::kRepeated:
      return "has the stamp of the last";
    case StampVerdict::kOld:
      return "is older than the last";
    case StampVerdict::kFuture:
      return "is stamped in the future";
    case StampVerdict::kAbsurd:
      return "has an absurd stamp";
  }
  return "?";
}

/// An instant that a clock of our time can show: sums and differences of two cannot overflow.
constexpr bool is_plausible(Time stamp) { return stamp.us > 0 && stamp.us < (int64_t{1} << 53); }

struct StampRule {
  Duration tolerance = seconds(1);
  int patience = 3;                   // ≥ 2
  Duration span = milliseconds(250);  // longer than a network re-orders
};

class NewestStamp {
 public:
  explicit NewestStamp(const StampRule& rule = {}) : rule_(rule) {}

  /// `now`: when the message arrived, on the receiver's clock.
  [[nodiscard]] StampVerdict judge(Time now, Time stamp) {
    if (!is_plausible(stamp)) return StampVerdict::kAbsurd;
    if (newest_ && stamp == *newest_) return StampVerdict::kRepeated;
    const Duration lead = stamp - now;
    const bool is_newer = !newest_ || stamp > *newest_;
    if (is_newer && lead <= allowed_lead_ + rule_.tolerance) {
      allowed_lead_ = std::max(Duration{}, lead);
      take(stamp);
      return StampVerdict::kNewer;
    }
    if (!persists(now, stamp, lead)) return is_newer ? StampVerdict::kFuture : StampVerdict::kOld;
    allowed_lead_ = std::max(Duration{}, lead);
    take(stamp);
    return StampVerdict::kRestarted;
  }
  std::optional<Time> newest() const { return newest_; }

 private:
  struct Contender {
    Time stamp, since;
    Duration lead;
    int count = 0;
  };

  void take(Time stamp) {
    newest_ = stamp;
    contender_.reset();
  }
  bool persists(Time now, Time stamp, Duration lead) {
    const bool continues = contender_ && stamp > contender_->stamp && now >= contender_->since &&
                           lead <= contender_->lead + rule_.tolerance &&
                           contender_->lead <= lead + rule_.tolerance;
    if (!continues) contender_ = Contender{stamp, now, lead, 0};
    contender_->stamp = stamp;
    contender_->lead = lead;
    ++contender_->count;
    return contender_->count >= rule_.patience && now - contender_->since >= rule_.span;
  }

  StampRule rule_;
  std::optional<Time> newest_;
  Duration allowed_lead_;  // of a sender whose clock is, or runs, ahead
  std::optional<Contender> contender_;
};

}  // namespace foresight
