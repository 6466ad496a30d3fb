// A camera's poses over time, as trajectory files in TUM's format have them.
//
//   const std::vector<TimedPose> track = load_pose_track("groundtruth.txt");
//   if (const auto world_from_cam = pose_at(track, time)) …
#pragma once

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/frames.h"
#include "common/time.h"

namespace foresight {

struct TimedPose {
  Time time;
  Pose<World, Cam> world_from_cam;
};

/// Between the two poses around an instant: positions linearly, rotations on the shortest way.
/// Nothing outside the track, or between two poses more than max_gap apart. The times increase.
/// O(log n).
std::optional<Pose<World, Cam>> pose_at(std::span<const TimedPose> track, Time time,
                                        Duration max_gap = {std::numeric_limits<int64_t>::max()});

/// Reads a trajectory file: "time tx ty tz qx qy qz qw" per line, in seconds (or as text_lines.h
/// says) and metres, camera to world. Throws UnavailableError where it cannot be read, ConfigError
/// with file and line where a line is no pose, where times decrease, and where there are fewer than
/// two poses. Of several with the same time the first counts.
std::vector<TimedPose> load_pose_track(const std::string& path);

}  // namespace foresight
