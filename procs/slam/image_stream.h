// The order and the losses of a camera's images, from their time-stamps and numbers.
//
// Time-stamps: the stream that keeps coming wins. An image counts when its stamp follows the last
// one's by no more than the time that has passed allows; one that does not (older, or far in the
// future) is refused, but when such images follow each other for a second and nothing else comes,
// the camera's clock was set, and they are the stream.
//
// Numbers: a gap is so many lost images; a number that goes back, or further ahead than any camera
// can be, is another source (a camera that was started anew). Images that this process passed over
// by itself are no losses.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "common/time.h"

namespace foresight {

enum class ImageVerdict {
  kNext,
  kNotNewer,  // repeated, or older than the last
  kJumps,     // too far ahead of the last
  kAbsurd,    // no time at all
};

class ImageStream {
 public:
  /// One image has arrived. `passed_over`: how many arrived since the start that were never looked
  /// at. Call count() for every image and judge() for those that can be read.
  void count(Time now, Time stamp, int32_t number, int64_t passed_over);
  [[nodiscard]] ImageVerdict judge(Time now, Time stamp);

  struct Losses {
    int64_t lost = 0, repeated = 0, source_changes = 0;  // since the start
    int64_t recently_lost = 0, recently_arrived = 0, recent_source_changes = 0;
    double share() const {  // lost, of those that were sent lately
      const int64_t sent = recently_lost + recently_arrived;
      return sent > 0 ? static_cast<double>(recently_lost) / static_cast<double>(sent) : 0;
    }
  };
  /// "Recent" are the last five seconds.
  Losses losses(Time now);

 private:
  struct Second {
    int64_t index = 0;
    int64_t arrived = 0, lost = 0, source_changes = 0;
  };
  struct Arrival {
    Time at, stamp;
    int32_t number = 0;
  };
  struct Contender {
    Time since, at, stamp;
    int images = 0;
  };
  Second& present(Time now);
  void add_loss(Time now, int64_t images);
  void drop_old(Time now);

  std::optional<Arrival> counted_;  // the last image
  int64_t passed_over_ = 0;
  Losses total_;
  std::deque<Second> seconds_;

  std::optional<Time> accepted_;  // newest stamp
  Time accepted_at_;
  std::optional<Contender> contender_;
};

}  // namespace foresight
