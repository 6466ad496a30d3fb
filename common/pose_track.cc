#include "common/pose_track.h"

#include <algorithm>

namespace foresight {

std::optional<Pose<World, Cam>> pose_at(std::span<const TimedPose> track, Time time,
                                        Duration max_gap) {
  const auto after = std::lower_bound(track.begin(), track.end(), time,
                                      [](const TimedPose& p, Time t) { return p.time < t; });
  if (after == track.end()) return std::nullopt;
  if (after->time == time) return after->world_from_cam;
  if (after == track.begin()) return std::nullopt;
  const TimedPose &a = *(after - 1), &b = *after;
  if (b.time - a.time > max_gap) return std::nullopt;
  const double share = (time - a.time).seconds() / (b.time - a.time).seconds();
  return Pose<World, Cam>(
      a.world_from_cam.rotation().slerp(share, b.world_from_cam.rotation()),
      (1 - share) * a.world_from_cam.translation() + share * b.world_from_cam.translation());
}

}  // namespace foresight
