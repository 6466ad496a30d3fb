// What becomes of a map while the camera goes on for many minutes: a row per minute of the
// sequence.
#pragma once

#include <cstdint>
#include <vector>

#include "common/time.h"
#include "procs/slam/slam.h"

namespace foresight {

/// Of one minute: its end, or all of it.
struct Minute {
  int minute = 0;  // since the first image
  int images = 0, tracked = 0;
  int keyframes = 0, points = 0;  // in the map at its end
  double map_mb = 0;              // estimate of what the map needs
  double track_ms_median = 0, track_ms_p95 = 0, job_ms_max = 0;
  double error_m_rmse = -1;  // of the positions, aligned over the whole sequence; −1: no truth
};

class Timeline {
 public:
  /// What an image took, and what the mapping after it did.
  void note_image(Time time, bool is_tracked, double track_ms, const SlamStatistics& after);
  void note_job(double job_ms) { job_ms_.push_back(job_ms); }
  /// Call once, after the last image. Errors are still missing.
  std::vector<Minute> take();
  int minute_of(Time time) const;

 private:
  void close_minute();

  std::vector<Minute> minutes_;
  Minute current_;
  Time first_;
  std::vector<double> track_ms_, job_ms_;
};

}  // namespace foresight
