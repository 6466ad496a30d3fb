#include "procs/slam/relocalizer.h"

#include <utility>

namespace foresight::slam {
namespace {

constexpr Duration kHintAge = milliseconds(300);  // of a hint that is still of use
constexpr int kRivalEvery = 5;         // doubtful images, from one look for rivals to the next
constexpr double kRivalMargin = 0.15;  // of quality

}  // namespace

Relocalizer::Relocalizer(const CameraModel& camera, const SlamOptions& options)
    : camera_(camera), options_(options), candidates_(camera) {}

bool Relocalizer::accepts(const TrackingAttempt& attempt) const {
  return attempt.quality >= options_.relocalise_min_quality &&
         attempt.inliers.size() >= static_cast<size_t>(options_.relocalise_min_inliers);
}

TrackingAttempt Relocalizer::best_attempt(const SlamMap& map, const Frame& frame,
                                          const std::vector<Pose<Map, Cam>>& poses) const {
  TrackingAttempt best;
  for (const Pose<Map, Cam>& pose : poses) {
    TrackingAttempt tried =
        track_points(camera_, map, frame.pyramid, pose, SearchWidth::kWide, options_);
    if (tried.quality >= best.quality) best = std::move(tried);
    if (accepts(best)) break;
  }
  return best;
}

TrackingAttempt Relocalizer::find(const SlamMap& map, PlaceIndex& places, const Frame& frame,
                                  const Pose<Map, Cam>& predicted) {
  std::vector<Pose<Map, Cam>> poses = {predicted};
  if (hint_ && frame.time - hint_->time < kHintAge && hint_->time - frame.time < kHintAge) {
    poses.insert(poses.begin(), hint_->map_from_cam);
  }
  for (const Pose<Map, Cam>& pose : candidates_.similar_views(map, frame.thumbnail)) {
    poses.push_back(pose);
  }
  TrackingAttempt best = best_attempt(map, frame, poses);
  if (accepts(best)) return best;
  places.follow(map);
  TrackingAttempt matched =
      best_attempt(map, frame, candidates_.matched_views(map, places, frame.pyramid));
  return matched.quality > best.quality ? matched : best;
}

// Few of the expected points: the image may be blurred, or it is of a place that merely looks like
// the one before, after a cut or a jerk. Then another place claims it with far more points.
TrackingAttempt Relocalizer::rival(const SlamMap& map, const Frame& frame,
                                   const TrackingAttempt& placed) {
  if (placed.quality >= options_.doubtful_quality) {
    doubtful_frames_ = 0;
    return {};
  }
  if (doubtful_frames_++ % kRivalEvery != 0) return {};
  TrackingAttempt other = best_attempt(map, frame, candidates_.similar_views(map, frame.thumbnail));
  const bool wins = accepts(other) && other.quality > placed.quality + kRivalMargin;
  return wins ? other : TrackingAttempt{};
}

}  // namespace foresight::slam
