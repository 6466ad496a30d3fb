#include "procs/carver/map_state.h"

#include <algorithm>
#include <cmath>

#include "procs/carver/constraint_lists.h"
#include "procs/carver/grow.h"

namespace foresight::carving {
namespace {

template <class IdType, class Index>
Index find_id(const std::unordered_map<IdType, Index>& map, IdType id) {
  const auto found = map.find(id);
  return found == map.end() ? Index() : found->second;
}

// Takes a place from the free list or makes a new one.
template <class Index, class Record>
Index allocate(IdVector<Index, Record>& records, std::vector<Index>& free) {
  if (free.empty()) return add_one(records);
  const Index place = free.back();
  free.pop_back();
  records[place] = Record{};
  return place;
}

template <class Index>
void erase_value(std::vector<Index>& values, Index value) {
  const auto at = std::find(values.begin(), values.end(), value);
  if (at == values.end()) return;
  *at = values.back();
  values.pop_back();
}

template <class Index>
void move_all(std::vector<Index>& from, std::vector<Index>& to) {
  to.insert(to.end(), from.begin(), from.end());
  from.clear();
}

}  // namespace

PointIndex MapState::find_point(PointId id) const { return find_id(point_by_id_, id); }
KeyframeIndex MapState::find_keyframe(KeyframeId id) const { return find_id(keyframe_by_id_, id); }

const StagedChanges& MapState::stage(const MapDelta& delta) {
  for (const auto& observation : delta.observations_removed) remove_observation(observation);
  for (const PointId id : delta.points_removed) remove_point(id);
  for (const KeyframeId id : delta.keyframes_removed) remove_keyframe(id);
  for (const auto& keyframe : delta.keyframes_set) set_keyframe(keyframe);
  for (const auto& point : delta.points_set) set_point(point);
  for (const auto& observation : delta.observations_added) add_observation(observation);
  return staged;
}

ConstraintIndex MapState::find_constraint(KeyframeIndex keyframe, PointIndex point) const {
  for (const ConstraintIndex constraint : points[point].constraints) {
    if (constraints[constraint].keyframe == keyframe) return constraint;
  }
  return {};
}

void MapState::remove_observation(const MapObservation& observation) {
  const KeyframeIndex keyframe = find_keyframe(observation.keyframe_id);
  const PointIndex point = find_point(observation.point_id);
  const bool both_known = keyframe.is_valid() && point.is_valid();
  const ConstraintIndex constraint =
      both_known ? find_constraint(keyframe, point) : ConstraintIndex();
  if (constraint.is_valid()) return retire_constraint(constraint);
  const bool perhaps_thinned = thinned_unremoved_ > 0 && both_known;
  thinned_unremoved_ -= perhaps_thinned;
  ignored += !perhaps_thinned;
}

void MapState::remove_point(PointId id) {
  const PointIndex point = find_point(id);
  if (!point.is_valid()) {
    ++ignored;
    return;
  }
  const std::vector<ConstraintIndex> lost = points[point].constraints;
  for (const ConstraintIndex constraint : lost) retire_constraint(constraint);
  detach(point);
  points[point].alive = false;
  point_by_id_.erase(id);
  dropped_points_.push_back(point);
  --live_points;
}

void MapState::remove_keyframe(KeyframeId id) {
  const KeyframeIndex keyframe = find_keyframe(id);
  if (!keyframe.is_valid()) {
    ++ignored;
    return;
  }
  const std::vector<ConstraintIndex> lost = keyframes[keyframe].constraints;
  for (const ConstraintIndex constraint : lost) retire_constraint(constraint);
  keyframes[keyframe].alive = false;
  keyframe_by_id_.erase(id);
  dropped_keyframes_.push_back(keyframe);
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
  KeyframeIndex place = find_keyframe(keyframe.id);
  if (!place.is_valid()) {
    place = allocate(keyframes, free_keyframes_);
    keyframe_by_id_[keyframe.id] = place;
    keyframes[place].arrival = ++arrivals_;
    ++live_keyframes;
  }
  KeyframeRecord& record = keyframes[place];
  record.id = keyframe.id;
  record.alive = true;
  if (record.centre == centre) return;
  reissue(record.constraints);
  keyframes[place].centre = centre;
  keyframes[place].start = Feature{};
}

void MapState::set_point(const MapPoint& point) {
  const Eigen::Vector3d p = point.position_in_map.cast<double>();
  const Point3 position{p.x() + 0.0, p.y() + 0.0, p.z() + 0.0};
  if (!point.id.is_valid() || !is_sane(position)) {
    ++ignored;
    return;
  }
  PointIndex place = find_point(point.id);
  if (!place.is_valid()) {
    place = allocate(points, free_points_);
    point_by_id_[point.id] = place;
    ++live_points;
  } else if (points[place].position == position) {
    return;
  } else {
    reissue(points[place].constraints);
    detach(place);
  }
  PointRecord& record = points[place];
  record.id = point.id;
  record.alive = true;
  record.position = position;
  if (!record.waiting) staged.attached.push_back(place);
  record.waiting = true;
}

void MapState::add_observation(const MapObservation& observation) {
  const KeyframeIndex keyframe = find_keyframe(observation.keyframe_id);
  const PointIndex point = find_point(observation.point_id);
  if (!keyframe.is_valid() || !point.is_valid() || find_constraint(keyframe, point).is_valid() ||
      live_constraints >= kMaxConstraints / 2) {
    ++ignored;
    return;
  }
  issue_constraint(keyframe, point);
}

void MapState::issue_constraint(KeyframeIndex keyframe, PointIndex point) {
  const ConstraintIndex constraint = allocate(constraints, free_constraints_);
  ConstraintRecord& record = constraints[constraint];
  record.keyframe = keyframe;
  record.point = point;
  record.state = ConstraintState::kNew;
  keyframes[keyframe].constraints.push_back(constraint);
  points[point].constraints.push_back(constraint);
  staged.issued.push_back(constraint);
  ++live_constraints;
}

void MapState::retire_constraint(ConstraintIndex constraint) {
  ConstraintRecord& record = constraints[constraint];
  KeyframeRecord& keyframe = keyframes[record.keyframe];
  PointRecord& point = points[record.point];
  if (record.state == ConstraintState::kTraced) {
    staged.retired.push_back({constraint, keyframe.centre, keyframe.start, point.vertex});
  }
  erase_value(keyframe.constraints, constraint);
  erase_value(point.constraints, constraint);
  record.state = ConstraintState::kRetired;
  dropped_constraints_.push_back(constraint);
  --live_constraints;
}

void MapState::thin_constraint(ConstraintIndex constraint) {
  constraints[constraint].state = ConstraintState::kTraced;  // also if only just
  retire_constraint(constraint);
  ++thinned_constraints;
  ++thinned_unremoved_;
}

// One end moves: traced constraints are replaced; new ones will be traced with the new geometry
// anyway.
void MapState::reissue(const std::vector<ConstraintIndex>& affected) {
  const std::vector<ConstraintIndex> copy = affected;
  for (const ConstraintIndex constraint : copy) {
    const ConstraintRecord record = constraints[constraint];
    if (record.state != ConstraintState::kTraced) continue;
    retire_constraint(constraint);
    issue_constraint(record.keyframe, record.point);
  }
}

void MapState::detach(PointIndex point) {
  PointRecord& record = points[point];
  if (!record.vertex.is_valid()) return;
  staged.detached.push_back({point, record.vertex});
  record.vertex = VertexIndex();
}

void MapState::finish() {
  for (const ConstraintIndex constraint : staged.issued) {
    ConstraintState& state = constraints[constraint].state;
    if (state == ConstraintState::kNew) state = ConstraintState::kTraced;
  }
  postpone();
}

void MapState::postpone() {
  staged = StagedChanges{};
  for (const ConstraintIndex constraint : dropped_constraints_)
    constraints[constraint].state = ConstraintState::kFree;
  move_all(dropped_constraints_, free_constraints_);
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
         constraints.capacity() * (sizeof(ConstraintRecord) + 3 * sizeof(ConstraintIndex)) +
         (live_points + live_keyframes) * 4 * sizeof(void*);
}

}  // namespace foresight::carving
