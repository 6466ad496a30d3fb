#include "tests/carver/map_model.h"

#include <algorithm>
#include <iterator>

namespace foresight::carver_test {

MapKeyframe keyframe_at(int32_t id, const Eigen::Vector3d& centre) {
  return {id, {Eigen::Quaterniond::Identity(), centre}};
}

void MapModel::apply(const MapDelta& delta) {
  for (const auto& seen : delta.observations_removed) observations.erase(seen);
  for (const int32_t id : delta.points_removed) {
    points.erase(id);
    std::erase_if(observations, [&](const auto& seen) { return seen.point_id == id; });
  }
  for (const int32_t id : delta.keyframes_removed) {
    cameras.erase(id);
    std::erase_if(observations, [&](const auto& seen) { return seen.keyframe_id == id; });
  }
  for (const auto& keyframe : delta.keyframes_set) {
    if (keyframe.id < 0 || !keyframe.map_from_cam.is_finite()) continue;
    cameras[keyframe.id] = keyframe.map_from_cam.translation();
  }
  for (const auto& point : delta.points_set) {
    if (point.id >= 0 && point.position_in_map.allFinite())
      points[point.id] = point.position_in_map;
  }
  for (const auto& seen : delta.observations_added) {
    if (cameras.contains(seen.keyframe_id) && points.contains(seen.point_id)) {
      observations.insert(seen);
    }
  }
}

MapDelta MapModel::whole() const {
  MapDelta delta;
  for (const auto& [id, centre] : cameras) delta.keyframes_set.push_back(keyframe_at(id, centre));
  for (const auto& [id, position] : points) delta.points_set.push_back({id, position});
  delta.observations_added.assign(observations.begin(), observations.end());
  return delta;
}

double MapGenerator::real(double low, double high) {
  return low + (high - low) * static_cast<double>(random_()) / 4294967296.0;
}

Eigen::Vector3d MapGenerator::place(bool camera) {
  Eigen::Vector3d p;
  if (layout_ == Layout::kGeneral) {
    p = {real(-1, 1), real(-1, 1), real(-1, 1)};
  } else if (layout_ == Layout::kLattice) {
    p = {below(4) + 0.0, below(4) + 0.0, below(4) + 0.0};
    if (camera && below(2) == 0) p += 0.5 * Eigen::Vector3d(below(2), below(2), below(2));
  } else {
    p = {below(5) + 0.25 * below(4), below(5) + 0.0, 0.0};
    if (camera && below(3) > 0) p.z() = below(3) + 1.0;
  }
  return scale_ * p;
}

template <class Map>
int32_t MapGenerator::pick(const Map& map) {
  return std::next(map.begin(), below(static_cast<int>(map.size())))->first;
}

void MapGenerator::add_keyframe(MapDelta& delta) {
  delta.keyframes_set.push_back(keyframe_at(next_keyframe_++, place(true)));
}

void MapGenerator::add_points(MapDelta& delta, int count) {
  for (int n = 0; n < count; ++n) {
    Eigen::Vector3f position = place(false).cast<float>();
    if (!model_.points.empty() && below(10) == 0) position = model_.points[pick(model_.points)];
    delta.points_set.push_back({next_point_++, position});
  }
}

void MapGenerator::add_observations(MapDelta& delta, int count) {
  for (int n = 0; n < count && next_point_ > 0 && next_keyframe_ > 0; ++n) {
    delta.observations_added.push_back({below(next_keyframe_), below(next_point_)});
  }
}

void MapGenerator::remove_some(MapDelta& delta) {
  for (int n = below(4); n > 0 && !model_.points.empty(); --n) {
    delta.points_removed.push_back(pick(model_.points));
  }
  for (int n = below(6); n > 0 && !model_.observations.empty(); --n) {
    const int at = below(static_cast<int>(model_.observations.size()));
    delta.observations_removed.push_back(*std::next(model_.observations.begin(), at));
  }
  if (model_.cameras.size() > 2 && below(3) == 0) {
    delta.keyframes_removed.push_back(pick(model_.cameras));
  }
}

void MapGenerator::move_some(MapDelta& delta) {
  for (int n = below(6); n > 0 && !model_.points.empty(); --n) {
    const int32_t id = pick(model_.points);
    if (std::count(delta.points_removed.begin(), delta.points_removed.end(), id) > 0) continue;
    delta.points_set.push_back({id, place(false).cast<float>()});
  }
  if (!model_.cameras.empty() && below(2) == 0) {
    const int32_t id = pick(model_.cameras);
    const auto& gone = delta.keyframes_removed;
    if (std::count(gone.begin(), gone.end(), id) > 0) return;
    delta.keyframes_set.push_back(keyframe_at(id, place(true)));
  }
}

MapDelta MapGenerator::next() {
  MapDelta delta;
  if (below(3) == 0) remove_some(delta);
  if (below(3) == 0) move_some(delta);
  if (below(2) == 0 || next_keyframe_ == 0) add_keyframe(delta);
  if (model_.points.size() < 30) add_points(delta, below(8));
  add_observations(delta, 2 + below(8));
  model_.apply(delta);
  return delta;
}

}  // namespace foresight::carver_test
