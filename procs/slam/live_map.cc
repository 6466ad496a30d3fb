#include "procs/slam/live_map.h"

#include <cstddef>
#include <iterator>
#include <utility>

#include "procs/slam/map_storage.h"
#include "procs/slam/thumbnail.h"

namespace foresight::slam {
namespace {

constexpr double kSamePlace = 0.1;      // depths, or radians: a better answer, but no other place
constexpr size_t kYoungKeyframes = 16;  // so far images may show that the camera never moved

}  // namespace

void Agenda::note_keyframe(KeyframeId id, const SlamOptions& options) {
  adjust_newest = true;
  if (options.close_loops) unlooped.push_back(id);
  --keyframes_to_check;
  ++keyframes_since_all;
}

void Agenda::note_loop_closed() {
  unlooped.clear();
  adjust_all = true;
}

LiveMap::LiveMap(const CameraModel& the_camera, const SlamOptions& the_options)
    : camera(the_camera),
      options(the_options),
      mapper(camera, options),
      motion(camera),
      relocalizer(camera, options),
      published(camera, options) {}

void LiveMap::begin(const InitialMap& initial) {
  reset_reason.clear();
  mapper.begin(initial, &map);
  agenda.adjust_newest = true;
  motion.forget();
  motion.update(initial.second.time, make_thumbnail(initial.second.pyramid),
                initial.second.map_from_cam);
  state = TrackingState::kTracking;
  good_frames = 1;
}

void LiveMap::restore(const StoredMap& stored) {
  map = restored(stored, camera);
  motion.update(stored.keyframes.back().time, map.newest_keyframe().thumbnail,
                stored.keyframes.back().map_from_cam);
  motion.forget();
  is_restored = true;
  state = TrackingState::kLost;
}

Placement LiveMap::follow(const Frame& frame) {
  const Pose<Map, Cam> predicted =
      motion.predict(frame.time, frame.thumbnail, map.newest_keyframe().median_depth);
  Placement placed{attempt(frame, predicted, SearchWidth::kNarrow)};
  if (!is_good(placed.attempt)) {
    TrackingAttempt wide = attempt(frame, predicted, SearchWidth::kWide);
    if (wide.quality > placed.attempt.quality) placed.attempt = std::move(wide);
  }
  placed.is_good = is_good(placed.attempt);
  if (!placed.is_good) return placed;
  TrackingAttempt rival = relocalizer.rival(map, frame, placed.attempt);
  if (rival.quality > placed.attempt.quality) {
    placed.is_elsewhere = !same_place(rival, placed.attempt);
    placed.attempt = std::move(rival);
  }
  return placed;
}

TrackingAttempt LiveMap::attempt(const Frame& frame, const Pose<Map, Cam>& pose,
                                 SearchWidth width) const {
  return track_points(camera, map, frame.pyramid, pose, width, options);
}

bool LiveMap::is_good(const TrackingAttempt& attempt) const {
  return attempt.quality >= options.min_quality &&
         attempt.inliers.size() >= static_cast<size_t>(options.min_found_points);
}

bool LiveMap::same_place(const TrackingAttempt& a, const TrackingAttempt& b) const {
  const Pose<Cam, Cam> between = a.map_from_cam.inverse() * b.map_from_cam;
  return between.translation().norm() < kSamePlace * map.newest_keyframe().median_depth &&
         between.rotation().angularDistance(Eigen::Quaterniond::Identity()) < kSamePlace;
}

// Since then the camera has moved on. The keyframe halfway is far enough away to tell, and what
// moves was elsewhere by then.
std::optional<StillEvidence> LiveMap::refutation_by_newest_keyframe() const {
  if (is_restored || map.keyframes().size() > kYoungKeyframes) return std::nullopt;
  const auto half = static_cast<std::ptrdiff_t>(map.keyframes().size() / 2);
  const Keyframe& middle = std::next(map.keyframes().begin(), half)->second;
  const Keyframe& newest = map.newest_keyframe();
  const Pose<Cam, Cam> newest_from_middle = newest.map_from_cam.inverse() * middle.map_from_cam;
  StillEvidence evidence = still_evidence(
      camera, {middle.pyramid, newest.pyramid, newest_from_middle, middle.median_depth});
  if (!evidence.says_still()) return std::nullopt;
  return evidence;
}

}  // namespace foresight::slam
