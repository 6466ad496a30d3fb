#include "tests/carver/hostile_map.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <limits>

#include "tests/carver/random_numbers.h"

namespace foresight::carver_test {
namespace {

// Of the map as often as not.
template <class Map>
typename Map::key_type any_id(const Map& map, std::mt19937& random) {
  using Limits = std::numeric_limits<int32_t>;
  constexpr std::array kOdd{-1, -8, Limits::min(), Limits::max(), 7777, 1 << 24};
  if (map.empty() || below(random, 2) == 0) return typename Map::key_type(one_of(kOdd, random));
  return std::next(map.begin(), below(random, static_cast<int>(map.size())))->first;
}

// Those that are allowed and huge are rare: they shrink the rest of the map to a dot.
double odd_number(std::mt19937& random) {
  using Limits = std::numeric_limits<double>;
  constexpr std::array kRefused{
      Limits::quiet_NaN(), Limits::infinity(), -Limits::infinity(), 1e30, 1.001e9, -1e38};
  constexpr std::array kSmall{0.0, -0.0, 1e-45, -1e-30, 1e-12, 1.0};
  constexpr std::array kHuge{3e8, -1e9, 1e7};
  if (below(random, 60) == 0) return one_of(kHuge, random);
  return below(random, 2) == 0 ? one_of(kRefused, random) : one_of(kSmall, random);
}

Eigen::Vector3d odd_place(const MapModel& model, std::mt19937& random) {
  Eigen::Vector3d p(0.5, 0.25, 0.125);
  if (!model.points.empty()) {
    const int at = below(random, static_cast<int>(model.points.size()));
    p = std::next(model.points.begin(), at)->second.cast<double>();
  }
  if (below(random, 3) > 0) p[below(random, 3)] = odd_number(random);
  return p;
}

using Writer = void (*)(const MapModel& model, std::mt19937& random, MapDelta& delta);

void add_point(const MapModel& model, std::mt19937& random, MapDelta& delta) {
  const PointId id = any_id(model.points, random);
  delta.points_set.push_back({id, odd_place(model, random).cast<float>()});
}

void add_camera(const MapModel& model, std::mt19937& random, MapDelta& delta) {
  MapKeyframe keyframe = keyframe_at(any_id(model.cameras, random), odd_place(model, random));
  const Eigen::Vector3d centre = keyframe.map_from_cam.translation();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  if (below(random, 4) == 0) keyframe.map_from_cam = {Eigen::Quaterniond(nan, 0, 0, 0), centre};
  delta.keyframes_set.push_back(keyframe);
}

void add_observation(const MapModel& model, std::mt19937& random, MapDelta& delta) {
  const KeyframeId keyframe = any_id(model.cameras, random);
  delta.observations_added.push_back({keyframe, any_id(model.points, random)});
}

void lose_observation(const MapModel& model, std::mt19937& random, MapDelta& delta) {
  const KeyframeId keyframe = any_id(model.cameras, random);
  delta.observations_removed.push_back({keyframe, any_id(model.points, random)});
}

void remove_point(const MapModel& model, std::mt19937& random, MapDelta& delta) {
  delta.points_removed.push_back(any_id(model.points, random));
}

void remove_camera(const MapModel& model, std::mt19937& random, MapDelta& delta) {
  delta.keyframes_removed.push_back(any_id(model.cameras, random));
}

void replace_point(const MapModel& model, std::mt19937& random, MapDelta& delta) {
  if (model.points.empty()) return;
  const auto& [id, position] =
      *std::next(model.points.begin(), below(random, static_cast<int>(model.points.size())));
  delta.points_removed.push_back(id);
  delta.points_set.push_back({id, position});
  for (const MapObservation& seen : model.observations) {
    if (seen.point_id == id && below(random, 2) == 0) delta.observations_added.push_back(seen);
  }
}

void replace_camera(const MapModel& model, std::mt19937& random, MapDelta& delta) {
  if (model.cameras.empty()) return;
  const auto& [id, centre] =
      *std::next(model.cameras.begin(), below(random, static_cast<int>(model.cameras.size())));
  delta.keyframes_removed.push_back(id);
  delta.keyframes_set.push_back(keyframe_at(id, centre));
  for (const MapObservation& seen : model.observations) {
    if (seen.keyframe_id == id && below(random, 2) == 0) delta.observations_added.push_back(seen);
  }
}

void remove_and_observe(const MapModel& model, std::mt19937& random, MapDelta& delta) {
  if (model.observations.empty()) return;
  const MapObservation seen = *std::next(
      model.observations.begin(), below(random, static_cast<int>(model.observations.size())));
  below(random, 2) == 0 ? delta.points_removed.push_back(seen.point_id)
                        : delta.keyframes_removed.push_back(seen.keyframe_id);
  delta.observations_added.push_back(seen);
}

template <class Entries>
void repeat_last(Entries& entries) {
  if (!entries.empty()) entries.push_back(typename Entries::value_type(entries.back()));
}

void repeat_everything(const MapModel&, std::mt19937&, MapDelta& delta) {
  repeat_last(delta.observations_removed);
  repeat_last(delta.points_removed);
  repeat_last(delta.keyframes_removed);
  repeat_last(delta.keyframes_set);
  repeat_last(delta.points_set);
  repeat_last(delta.observations_added);
}

}  // namespace

void add_hostile_entries(const MapModel& model, std::mt19937& random, MapDelta& delta) {
  constexpr std::array<Writer, 10> kWriters{
      add_point,     add_camera,    add_observation, lose_observation,   remove_point,
      remove_camera, replace_point, replace_camera,  remove_and_observe, repeat_everything};
  for (int n = 1 + below(random, 5); n > 0; --n) one_of(kWriters, random)(model, random, delta);
}

}  // namespace foresight::carver_test
