#include "procs/carver/map_state.h"

#include <algorithm>
#include <cmath>

#include "procs/carver/constraint_lists.h"
#include "procs/carver/grow.h"

namespace foresight::carving {
namespace {

template <class IdType>
int32_t find_id(const std::unordered_map<IdType, int32_t>& map, IdType id) {
  const auto found = map.find(id);
  return found == map.end() ? -1 : found->second;
}

// Takes a number from the free list or makes a new one.
template <class Record>
int32_t allocate(std::vector<Record>& records, std::vector<int32_t>& free) {
  if (free.empty()) {
    add_one(records);
    return static_cast<int32_t>(records.size()) - 1;
  }
  const int32_t number = free.back();
  free.pop_back();
  records[static_cast<size_t>(number)] = Record{};
  return number;
}

void erase_value(std::vector<int32_t>& values, int32_t value) {
  const auto at = std::find(values.begin(), values.end(), value);
  if (at == values.end()) return;
  *at = values.back();
  values.pop_back();
}

void move_all(std::vector<int32_t>& from, std::vector<int32_t>& to) {
  to.insert(to.end(), from.begin(), from.end());
  from.clear();
}

}  // namespace

int32_t MapState::find_point(PointId id) const { return find_id(point_by_id_, id); }
int32_t MapState::find_keyframe(KeyframeId id) const { return find_id(keyframe_by_id_, id); }

const StagedChanges& MapState::stage(const MapDelta& delta) {
  for (const auto& observation : delta.observations_removed) remove_observation(observation);
  for (const PointId id : delta.points_removed) remove_point(id);
  for (const KeyframeId id : delta.keyframes_removed) remove_keyframe(id);
  for (const auto& keyframe : delta.keyframes_set) set_keyframe(keyframe);
  for (const auto& point : delta.points_set) set_point(point);
  for (const auto& observation : delta.observations_added) add_observation(observation);
  return staged;
}

int32_t MapState::find_ray(int32_t keyframe, int32_t point) const {
  for (const int32_t ray : points[static_cast<size_t>(point)].rays) {
    if (rays[static_cast<size_t>(ray)].keyframe == keyframe) return ray;
  }
  return -1;
}

void MapState::remove_observation(const MapObservation& observation) {
  const int32_t keyframe = find_keyframe(observation.keyframe_id);
  const int32_t point = find_point(observation.point_id);
  const int32_t ray = keyframe < 0 || point < 0 ? -1 : find_ray(keyframe, point);
  if (ray >= 0) return retire_ray(ray);
  const bool perhaps_thinned = thinned_unremoved_ > 0 && keyframe >= 0 && point >= 0;
  thinned_unremoved_ -= perhaps_thinned;
  ignored += !perhaps_thinned;
}

void MapState::remove_point(PointId id) {
  const int32_t number = find_point(id);
  if (number < 0) {
    ++ignored;
    return;
  }
  const std::vector<int32_t> lost = points[static_cast<size_t>(number)].rays;
  for (const int32_t ray : lost) retire_ray(ray);
  detach(number);
  points[static_cast<size_t>(number)].alive = false;
  point_by_id_.erase(id);
  dropped_points_.push_back(number);
  --live_points;
}

void MapState::remove_keyframe(KeyframeId id) {
  const int32_t number = find_keyframe(id);
  if (number < 0) {
    ++ignored;
    return;
  }
  const std::vector<int32_t> lost = keyframes[static_cast<size_t>(number)].rays;
  for (const int32_t ray : lost) retire_ray(ray);
  keyframes[static_cast<size_t>(number)].alive = false;
  keyframe_by_id_.erase(id);
  dropped_keyframes_.push_back(number);
  --live_keyframes;
}

bool MapState::is_sane(const Point3& position) const {
  return std::all_of(position.begin(), position.end(),
                     [&](double x) { return std::abs(x) <= max_coordinate_; });  // no NaN either
}

void MapState::set_keyframe(const MapKeyframe& keyframe) {
  const Eigen::Vector3d& c = keyframe.map_from_cam.translation();
  const Point3 centre{c.x() + 0.0, c.y() + 0.0, c.z() + 0.0};
  if (!keyframe.id.is_valid() || !is_sane(centre)) {
    ++ignored;
    return;
  }
  int32_t number = find_keyframe(keyframe.id);
  if (number < 0) {
    number = allocate(keyframes, free_keyframes_);
    keyframe_by_id_[keyframe.id] = number;
    keyframes[static_cast<size_t>(number)].arrival = ++arrivals_;
    ++live_keyframes;
  }
  KeyframeRecord& record = keyframes[static_cast<size_t>(number)];
  record.id = keyframe.id;
  record.alive = true;
  if (record.centre == centre) return;
  reissue(record.rays);
  keyframes[static_cast<size_t>(number)].centre = centre;
  keyframes[static_cast<size_t>(number)].start = Feature{};
}

void MapState::set_point(const MapPoint& point) {
  const Eigen::Vector3d p = point.position_in_map.cast<double>();
  const Point3 position{p.x() + 0.0, p.y() + 0.0, p.z() + 0.0};
  if (!point.id.is_valid() || !is_sane(position)) {
    ++ignored;
    return;
  }
  int32_t number = find_point(point.id);
  if (number < 0) {
    number = allocate(points, free_points_);
    point_by_id_[point.id] = number;
    ++live_points;
  } else if (points[static_cast<size_t>(number)].position == position) {
    return;
  } else {
    reissue(points[static_cast<size_t>(number)].rays);
    detach(number);
  }
  PointRecord& record = points[static_cast<size_t>(number)];
  record.id = point.id;
  record.alive = true;
  record.position = position;
  if (!record.waiting) staged.attached.push_back(number);
  record.waiting = true;
}

void MapState::add_observation(const MapObservation& observation) {
  const int32_t keyframe = find_keyframe(observation.keyframe_id);
  const int32_t point = find_point(observation.point_id);
  if (keyframe < 0 || point < 0 || find_ray(keyframe, point) >= 0 || live_rays >= kMaxRays / 2) {
    ++ignored;
    return;
  }
  issue_ray(keyframe, point);
}

void MapState::issue_ray(int32_t keyframe, int32_t point) {
  const int32_t ray = allocate(rays, free_rays_);
  RayRecord& record = rays[static_cast<size_t>(ray)];
  record.keyframe = keyframe;
  record.point = point;
  record.state = RayState::kNew;
  keyframes[static_cast<size_t>(keyframe)].rays.push_back(ray);
  points[static_cast<size_t>(point)].rays.push_back(ray);
  staged.issued.push_back(ray);
  ++live_rays;
}

void MapState::retire_ray(int32_t ray) {
  RayRecord& record = rays[static_cast<size_t>(ray)];
  KeyframeRecord& keyframe = keyframes[static_cast<size_t>(record.keyframe)];
  PointRecord& point = points[static_cast<size_t>(record.point)];
  if (record.state == RayState::kTraced) {
    staged.retired.push_back({ray, keyframe.centre, keyframe.start, point.vertex});
  }
  erase_value(keyframe.rays, ray);
  erase_value(point.rays, ray);
  record.state = RayState::kRetired;
  dropped_rays_.push_back(ray);
  --live_rays;
}

void MapState::thin_ray(int32_t ray) {
  rays[static_cast<size_t>(ray)].state = RayState::kTraced;  // also if only just
  retire_ray(ray);
  ++thinned_rays;
  ++thinned_unremoved_;
}

// One end moves: traced rays are replaced; new ones will be traced with the new geometry anyway.
void MapState::reissue(const std::vector<int32_t>& affected) {
  const std::vector<int32_t> copy = affected;
  for (const int32_t ray : copy) {
    const RayRecord record = rays[static_cast<size_t>(ray)];
    if (record.state != RayState::kTraced) continue;
    retire_ray(ray);
    issue_ray(record.keyframe, record.point);
  }
}

void MapState::detach(int32_t number) {
  PointRecord& record = points[static_cast<size_t>(number)];
  if (record.vertex < 0) return;
  staged.detached.push_back({number, record.vertex});
  record.vertex = -1;
}

void MapState::finish() {
  for (const int32_t ray : staged.issued) {
    RayState& state = rays[static_cast<size_t>(ray)].state;
    if (state == RayState::kNew) state = RayState::kTraced;
  }
  postpone();
}

void MapState::postpone() {
  staged = StagedChanges{};
  for (const int32_t ray : dropped_rays_) rays[static_cast<size_t>(ray)].state = RayState::kFree;
  move_all(dropped_rays_, free_rays_);
  move_all(dropped_points_, free_points_);
  move_all(dropped_keyframes_, free_keyframes_);
}

Extent MapState::extent() const {
  Extent extent;
  for (const PointRecord& point : points) {
    if (point.alive) extent.add(point.position);
  }
  for (const KeyframeRecord& keyframe : keyframes) {
    if (keyframe.alive) extent.add(keyframe.centre);
  }
  return extent;
}

size_t MapState::memory_bytes() const {
  return points.capacity() * sizeof(PointRecord) + keyframes.capacity() * sizeof(KeyframeRecord) +
         rays.capacity() * (sizeof(RayRecord) + 3 * sizeof(int32_t)) +
         static_cast<size_t>(live_points + live_keyframes) * 4 * sizeof(void*);
}

}  // namespace foresight::carving
