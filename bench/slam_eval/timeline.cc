#include "bench/slam_eval/timeline.h"

#include <utility>

#include "bench/slam_eval/score.h"

namespace foresight {

int Timeline::minute_of(Time time) const {
  return static_cast<int>((time - first_).seconds() / 60);
}

void Timeline::note_image(Time time, bool is_tracked, double track_ms,
                          const SlamStatistics& after) {
  if (current_.images == 0 && minutes_.empty()) first_ = time;
  if (minute_of(time) != current_.minute && current_.images > 0) {
    close_minute();
    current_ = {};
  }
  current_.minute = minute_of(time);
  ++current_.images;
  current_.tracked += is_tracked ? 1 : 0;
  current_.keyframes = after.keyframes;
  current_.points = after.points;
  current_.map_mb = after.memory_mb;
  track_ms_.push_back(track_ms);
}

void Timeline::close_minute() {
  current_.track_ms_median = quantile(track_ms_, 0.5);
  current_.track_ms_p95 = quantile(std::exchange(track_ms_, {}), 0.95);
  current_.job_ms_max = quantile(std::exchange(job_ms_, {}), 1.0);
  minutes_.push_back(current_);
}

std::vector<Minute> Timeline::take() {
  if (current_.images > 0) close_minute();
  return std::exchange(minutes_, {});
}

}  // namespace foresight
