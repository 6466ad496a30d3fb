#include "procs/slam/published_map.h"

#include <algorithm>
#include <iterator>

#include "procs/slam/point_uncertainty.h"

namespace foresight::slam {
namespace {

constexpr float kOtherCertainty = 1.5F;  // ratio of standard deviations that is worth a message

std::vector<KeyframeId> keyframes_of(const Point& point) {
  std::vector<KeyframeId> ids;
  for (const Observation& o : point.observations) ids.push_back(o.keyframe_id);
  return ids;
}

std::vector<KeyframeId> without(const std::vector<KeyframeId>& a,
                                const std::vector<KeyframeId>& b) {
  std::vector<KeyframeId> difference;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(difference));
  return difference;
}

}  // namespace

PublishedMap::PublishedMap(const CameraModel& camera, const SlamOptions& options)
    : camera_(camera), options_(options) {}

double PublishedMap::threshold_rad() const { return options_.delta_threshold_px / camera_.fx_px; }

MapDelta PublishedMap::take(SlamMap* map) {
  MapDelta delta;
  const SlamMap::Touched touched = map->take_touched();
  for (const KeyframeId id : touched.keyframes) take_keyframe(*map, id, &delta);
  for (const PointId id : touched.points) take_point(*map, id, &delta);
  std::sort(delta.observations_added.begin(), delta.observations_added.end());
  std::sort(delta.observations_removed.begin(), delta.observations_removed.end());
  return delta;
}

void PublishedMap::take_keyframe(const SlamMap& map, KeyframeId id, MapDelta* delta) {
  const Keyframe* keyframe = map.keyframe(id);
  const auto sent = keyframes_.find(id);
  if (keyframe == nullptr) {
    if (sent == keyframes_.end()) return;
    delta->keyframes_removed.push_back(id);
    keyframes_.erase(sent);
    return;
  }
  if (sent != keyframes_.end()) {
    const Pose<Map, Cam>& old = sent->second.map_from_cam;
    const Pose<Map, Cam>& now = keyframe->map_from_cam;
    const double moved = (old.translation() - now.translation()).norm() / keyframe->median_depth;
    const double turned = old.rotation().angularDistance(now.rotation());
    if (moved < threshold_rad() && turned < threshold_rad()) return;
  }
  keyframes_[id] = {id, keyframe->map_from_cam, keyframe->time};
  delta->keyframes_set.push_back(keyframes_[id]);
}

void PublishedMap::take_point(const SlamMap& map, PointId id, MapDelta* delta) {
  const Point* point = map.point(id);
  const auto sent = points_.find(id);
  if (point == nullptr) {
    if (sent == points_.end()) return;
    delta->points_removed.push_back(id);
    points_.erase(sent);
    return;
  }
  if (!point->confirmed) return;
  const Eigen::Vector3f position = point->position_in_map.cast<float>();
  SentPoint& known = points_[id];
  const bool is_new = sent == points_.end();
  const Keyframe& source = *map.keyframe(point->source.keyframe_id);
  const double distance = (point->position_in_map - source.map_from_cam.translation()).norm();
  const auto sigma = static_cast<float>(position_sigma(map, *point));
  const bool moved = (position - known.position_in_map).norm() > threshold_rad() * distance;
  const bool as_certain =
      sigma <= kOtherCertainty * known.sigma_mu && known.sigma_mu <= kOtherCertainty * sigma;
  if (is_new || moved || !as_certain) {
    if (is_new || moved) known.position_in_map = position;
    known.sigma_mu = sigma;
    delta->points_set.push_back({id, known.position_in_map, sigma});
  }
  std::vector<KeyframeId> keyframe_ids = keyframes_of(*point);
  for (const KeyframeId k : without(keyframe_ids, known.keyframe_ids)) {
    delta->observations_added.push_back({k, id});
  }
  for (const KeyframeId k : without(known.keyframe_ids, keyframe_ids)) {
    delta->observations_removed.push_back({k, id});
  }
  known.keyframe_ids = std::move(keyframe_ids);
}

MapDelta PublishedMap::snapshot() const {
  MapDelta all;
  for (const auto& [id, keyframe] : keyframes_) all.keyframes_set.push_back(keyframe);
  for (const auto& [id, point] : points_) {
    all.points_set.push_back({id, point.position_in_map, point.sigma_mu});
    for (const KeyframeId k : point.keyframe_ids)
      all.observations_added.push_back({k, id});
  }
  std::sort(all.observations_added.begin(), all.observations_added.end());
  return all;
}

}  // namespace foresight::slam
