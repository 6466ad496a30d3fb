#include "procs/slam/slam_map.h"

#include <algorithm>
#include <utility>

#include "common/check.h"

namespace foresight::slam {
namespace {

template <class Observations>
auto find_observation(Observations& observations, KeyframeId keyframe_id) {
  return std::lower_bound(observations.begin(), observations.end(), keyframe_id,
                          [](const Observation& o, KeyframeId id) { return o.keyframe_id < id; });
}

constexpr size_t kNodeBytes = 48;     // of an entry in a tree, beside its content
constexpr size_t kFeatureBytes = 96;  // a descriptor, its pixel and its places in the index

size_t keyframe_bytes(const Keyframe& keyframe) {
  size_t bytes = sizeof(Keyframe) + kNodeBytes;
  for (const cv::Mat& level : keyframe.pyramid.levels) bytes += level.total() * level.elemSize();
  bytes += keyframe.thumbnail.pixels.total() * keyframe.thumbnail.pixels.elemSize();
  if (keyframe.features) bytes += keyframe.features->pixels.size() * kFeatureBytes;
  return bytes + keyframe.point_ids.size() * (sizeof(Observation) + kNodeBytes);
}

}  // namespace

const Observation* Point::observation_in(KeyframeId keyframe_id) const {
  const auto it = find_observation(observations, keyframe_id);
  return it != observations.end() && it->keyframe_id == keyframe_id ? &*it : nullptr;
}

const Keyframe* SlamMap::keyframe(KeyframeId id) const {
  const auto it = keyframes_.find(id);
  return it == keyframes_.end() ? nullptr : &it->second;
}

const Point* SlamMap::point(PointId id) const {
  const auto it = points_.find(id);
  return it == points_.end() ? nullptr : &it->second;
}

const Keyframe& SlamMap::newest_keyframe() const {
  FORESIGHT_CHECK(!keyframes_.empty());
  return keyframes_.rbegin()->second;
}

KeyframeId SlamMap::add_keyframe(Keyframe keyframe) {
  keyframe.id = std::exchange(next_keyframe_id_, next_keyframe_id_.next());
  touched_.keyframes.insert(keyframe.id);
  const KeyframeId id = keyframe.id;
  keyframes_.emplace(id, std::move(keyframe));
  return id;
}

PointId SlamMap::add_point(const Eigen::Vector3d& position_in_map, const Corner& source) {
  FORESIGHT_CHECK(keyframes_.contains(source.keyframe_id));
  Point point;
  point.id = std::exchange(next_point_id_, next_point_id_.next());
  point.position_in_map = position_in_map;
  point.source = source;
  point.born_keyframe_id = KeyframeId(next_keyframe_id_.value() - 1);
  const PointId id = point.id;
  points_.emplace(id, std::move(point));
  touched_.points.insert(id);
  add_observation(
      id, {source.keyframe_id, source.level, source.pixel, source.ray.head<2>(), source.px_per_xy});
  return id;
}

void SlamMap::restore_keyframe(Keyframe keyframe) {
  FORESIGHT_CHECK(keyframe.id >= next_keyframe_id_ && keyframe.point_ids.empty());
  next_keyframe_id_ = keyframe.id;
  add_keyframe(std::move(keyframe));
}

void SlamMap::restore_point(Point point) {
  FORESIGHT_CHECK(point.id >= next_point_id_ && keyframes_.contains(point.source.keyframe_id));
  next_point_id_ = point.id.next();
  for (const Observation& o : point.observations) {
    keyframes_.at(o.keyframe_id).point_ids.insert(point.id);
  }
  touched_.points.insert(point.id);
  const PointId id = point.id;
  points_.emplace(id, std::move(point));
}

Point& SlamMap::point_ref(PointId id) {
  const auto it = points_.find(id);
  FORESIGHT_CHECK(it != points_.end());
  return it->second;
}

void SlamMap::remove_point(PointId id) {
  for (const Observation& o : point_ref(id).observations) {
    keyframes_.at(o.keyframe_id).point_ids.erase(id);
  }
  points_.erase(id);
  touched_.points.insert(id);
}

void SlamMap::remove_keyframe(KeyframeId id) {
  const std::set<PointId> point_ids = keyframes_.at(id).point_ids;
  for (const PointId point_id : point_ids) {
    FORESIGHT_CHECK(point_ref(point_id).source.keyframe_id != id);
    remove_observation(point_id, id);
  }
  keyframes_.erase(id);
  touched_.keyframes.insert(id);
}

void SlamMap::set_source(PointId point_id, const Corner& source) {
  FORESIGHT_CHECK(keyframes_.contains(source.keyframe_id));
  point_ref(point_id).source = source;
}

void SlamMap::set_features(KeyframeId keyframe_id, std::shared_ptr<const Features> features) {
  keyframes_.at(keyframe_id).features = std::move(features);
}

void SlamMap::move_keyframe(KeyframeId id, const Pose<Map, Cam>& map_from_cam) {
  keyframes_.at(id).map_from_cam = map_from_cam;
  touched_.keyframes.insert(id);
}

void SlamMap::scale_depth(KeyframeId keyframe_id, double factor) {
  keyframes_.at(keyframe_id).median_depth *= factor;
}

void SlamMap::move_point(PointId id, const Eigen::Vector3d& position_in_map) {
  point_ref(id).position_in_map = position_in_map;
  touched_.points.insert(id);
}

void SlamMap::add_observation(PointId point_id, const Observation& observation) {
  std::vector<Observation>& observations = point_ref(point_id).observations;
  const auto it = find_observation(observations, observation.keyframe_id);
  if (it != observations.end() && it->keyframe_id == observation.keyframe_id) {
    *it = observation;
    return;
  }
  observations.insert(it, observation);
  keyframes_.at(observation.keyframe_id).point_ids.insert(point_id);
  touched_.points.insert(point_id);
}

void SlamMap::remove_observation(PointId point_id, KeyframeId keyframe_id) {
  std::vector<Observation>& observations = point_ref(point_id).observations;
  const auto it = find_observation(observations, keyframe_id);
  if (it == observations.end() || it->keyframe_id != keyframe_id) return;
  observations.erase(it);
  keyframes_.at(keyframe_id).point_ids.erase(point_id);
  touched_.points.insert(point_id);
}

void SlamMap::count_prediction(PointId point_id, bool found) {
  Point& point = point_ref(point_id);
  ++point.predicted_count;
  if (found) ++point.found_count;
}

void SlamMap::merge_points(PointId kept, PointId merged) {
  FORESIGHT_CHECK(kept != merged);
  const Point gone = point_ref(merged);
  remove_point(merged);
  Point& point = point_ref(kept);
  for (const Observation& o : gone.observations) {
    if (point.observation_in(o.keyframe_id) == nullptr) add_observation(kept, o);
  }
  point.predicted_count += gone.predicted_count;
  point.found_count += gone.found_count;
  point.outlier_count += gone.outlier_count;
  point.confirmed = point.confirmed || gone.confirmed;
}

void SlamMap::count_outlier(PointId point_id) { ++point_ref(point_id).outlier_count; }

void SlamMap::confirm_point(PointId id) {
  point_ref(id).confirmed = true;
  touched_.points.insert(id);
}

SlamMap::Touched SlamMap::take_touched() { return std::exchange(touched_, {}); }

size_t SlamMap::memory_bytes() const {
  size_t bytes = points_.size() * (sizeof(Point) + kNodeBytes);
  for (const auto& [id, keyframe] : keyframes_) bytes += keyframe_bytes(keyframe);
  return bytes;
}

void SlamMap::validate() const {
  size_t observation_count = 0;
  for (const auto& [id, point] : points_) {
    FORESIGHT_CHECK(id == point.id && id < next_point_id_);
    FORESIGHT_CHECK(point.position_in_map.allFinite());
    FORESIGHT_CHECK(keyframes_.contains(point.source.keyframe_id));
    KeyframeId last;
    for (const Observation& o : point.observations) {
      FORESIGHT_CHECK(o.keyframe_id > last);
      FORESIGHT_CHECK(keyframes_.at(o.keyframe_id).point_ids.contains(id));
      last = o.keyframe_id;
    }
    observation_count += point.observations.size();
  }
  for (const auto& [id, keyframe] : keyframes_) {
    FORESIGHT_CHECK(id == keyframe.id && keyframe.map_from_cam.is_finite());
    for (const PointId point_id : keyframe.point_ids) {
      FORESIGHT_CHECK(points_.contains(point_id));
    }
    observation_count -= keyframe.point_ids.size();
  }
  FORESIGHT_CHECK(observation_count == 0);
}

const Point* point_near(const SlamMap& map, const Keyframe& keyframe, const Eigen::Vector2d& pixel,
                        double radius_px) {
  const Point* nearest = nullptr;
  for (const PointId id : keyframe.point_ids) {
    const Point* point = map.point(id);
    const double apart_px = (point->observation_in(keyframe.id)->pixel - pixel).norm();
    if (apart_px >= radius_px) continue;
    radius_px = apart_px;
    nearest = point;
  }
  return nearest;
}

std::map<KeyframeId, int> shared_point_counts(const SlamMap& map,
                                              const std::set<PointId>& point_ids) {
  if (map.empty()) return {};
  IdVector<KeyframeId, int> flat(map.newest_keyframe().id.next().index());
  for (const PointId id : point_ids) {
    const Point* point = map.point(id);
    if (point == nullptr) continue;
    for (const Observation& o : point->observations) ++flat[o.keyframe_id];
  }
  std::map<KeyframeId, int> counts;
  for (const KeyframeId id : flat.ids()) {
    if (flat[id] > 0) counts.emplace_hint(counts.end(), id, flat[id]);
  }
  return counts;
}

std::vector<KeyframeId> by_count(const std::map<KeyframeId, int>& counts) {
  std::vector<KeyframeId> ids;
  for (const auto& [id, count] : counts) ids.push_back(id);
  std::stable_sort(ids.begin(), ids.end(), [&](KeyframeId a, KeyframeId b) {
    return std::pair(counts.at(a), a) > std::pair(counts.at(b), b);
  });
  return ids;
}

std::vector<KeyframeId> first_few(std::vector<KeyframeId> ids, int count) {
  if (ids.size() > static_cast<size_t>(count)) ids.resize(static_cast<size_t>(count));
  return ids;
}

}  // namespace foresight::slam
