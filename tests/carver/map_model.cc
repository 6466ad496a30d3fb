#include "tests/carver/map_model.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "tests/carver/hostile_map.h"
#include "tests/carver/random_numbers.h"

namespace foresight::carver_test {
namespace {

// A brute-force carving is to take some milliseconds.
constexpr size_t kFewPoints = 30;
constexpr size_t kManyObservations = 250;

// As the carver by default: CarverOptions::max_coordinate_mu.
bool is_sane(const Eigen::Vector3d& position) {
  return position.allFinite() && position.cwiseAbs().maxCoeff() <= 1e9;
}

}  // namespace

MapKeyframe keyframe_at(KeyframeId id, const Eigen::Vector3d& centre) {
  return {id, {Eigen::Quaterniond::Identity(), centre}};
}

MapKeyframe keyframe_at(int32_t id, const Eigen::Vector3d& centre) {
  return keyframe_at(KeyframeId(id), centre);
}

void MapModel::apply(const MapDelta& delta) {
  for (const auto& seen : delta.observations_removed) observations.erase(seen);
  for (const PointId id : delta.points_removed) {
    points.erase(id);
    std::erase_if(observations, [&](const auto& seen) { return seen.point_id == id; });
  }
  for (const KeyframeId id : delta.keyframes_removed) {
    cameras.erase(id);
    std::erase_if(observations, [&](const auto& seen) { return seen.keyframe_id == id; });
  }
  for (const auto& keyframe : delta.keyframes_set) {
    const Eigen::Vector3d& centre = keyframe.map_from_cam.translation();
    if (keyframe.id.is_valid() && is_sane(centre)) cameras[keyframe.id] = centre;
  }
  for (const auto& point : delta.points_set) {
    if (!point.id.is_valid() || !is_sane(point.position_in_map.cast<double>())) continue;
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

MapGenerator::MapGenerator(Layout layout, uint32_t seed, double scale, double offset)
    : layout_(layout), scale_(scale), random_(seed) {
  map_from_layout_ =
      Eigen::Translation3d(scale * offset * Eigen::Vector3d(1, -1, 0.5)) * Eigen::Scaling(scale);
}

int MapGenerator::below(int bound) { return carver_test::below(random_, bound); }

void MapGenerator::start_over() {
  model_ = {};
  last_ = {};
  next_point_ = PointId(0);
  next_keyframe_ = KeyframeId(0);
}

Eigen::Vector3d MapGenerator::place(Placed what) {
  const Eigen::Vector3d p = map_from_layout_ * place_in(layout_, what, random_);
  return layout_ == Layout::kAtPoints ? p.cast<float>().cast<double>() : p;  // as points are
}

template <class Map>
typename Map::key_type MapGenerator::pick(const Map& map) {
  return std::next(map.begin(), below(static_cast<int>(map.size())))->first;
}

void MapGenerator::add_keyframe(MapDelta& delta) {
  delta.keyframes_set.push_back(keyframe_at(next_keyframe_, place(Placed::kCamera)));
  next_keyframe_ = next_keyframe_.next();
}

void MapGenerator::add_points(MapDelta& delta, int count) {
  for (int n = 0; n < count; ++n) {
    Eigen::Vector3f position = place(Placed::kPoint).cast<float>();
    if (!model_.points.empty() && below(10) == 0) position = model_.points[pick(model_.points)];
    delta.points_set.push_back({next_point_, position});
    next_point_ = next_point_.next();
  }
}

void MapGenerator::add_observations(MapDelta& delta, int count) {
  if (next_point_ == PointId(0) || next_keyframe_ == KeyframeId(0)) return;
  if (model_.observations.size() > kManyObservations) return;
  for (int n = 0; n < count; ++n) {
    const KeyframeId keyframe(below(next_keyframe_.value()));
    delta.observations_added.push_back({keyframe, PointId(below(next_point_.value()))});
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
    const PointId id = pick(model_.points);
    if (std::count(delta.points_removed.begin(), delta.points_removed.end(), id) > 0) continue;
    delta.points_set.push_back({id, place(Placed::kPoint).cast<float>()});
  }
  if (!model_.cameras.empty() && below(2) == 0) {
    const KeyframeId id = pick(model_.cameras);
    const auto& gone = delta.keyframes_removed;
    if (std::count(gone.begin(), gone.end(), id) > 0) return;
    delta.keyframes_set.push_back(keyframe_at(id, place(Placed::kCamera)));
  }
}

MapDelta MapGenerator::draw() {
  MapDelta delta;
  if (below(3) == 0) remove_some(delta);
  if (below(3) == 0) move_some(delta);
  if (below(2) == 0 || next_keyframe_ == KeyframeId(0)) add_keyframe(delta);
  if (model_.points.size() < kFewPoints) add_points(delta, below(8));
  add_observations(delta, 2 + below(8));
  return delta;
}

MapDelta MapGenerator::applied(MapDelta delta) {
  model_.apply(delta);
  last_ = delta;
  return delta;
}

MapDelta MapGenerator::repeat_last() { return applied(std::move(last_)); }

MapDelta MapGenerator::next() { return applied(draw()); }

MapDelta MapGenerator::next_hostile() {
  MapDelta delta = draw();
  add_hostile_entries(model_, random_, delta);
  return applied(std::move(delta));
}

MapDelta MapGenerator::grow_much() {
  MapDelta delta = draw();
  for (int n = 0; n < 4; ++n) add_keyframe(delta);
  if (model_.points.size() < kFewPoints) add_points(delta, 20);
  add_observations(delta, 60);
  return applied(std::move(delta));
}

MapDelta MapGenerator::remove_all() {
  MapDelta delta;
  const int what = below(3);
  for (const auto& [id, position] : model_.points) {
    if (what != 0) delta.points_removed.push_back(id);
  }
  for (const auto& [id, centre] : model_.cameras) {
    if (what != 1) delta.keyframes_removed.push_back(id);
  }
  return applied(std::move(delta));
}

// Turns of the axes, factors of two and whole steps keep exact what is exact.
Eigen::Affine3d MapGenerator::random_similarity() {
  const bool is_exact = below(2) == 0;
  Eigen::Vector3d shift, axis;
  for (int i = 0; i < 3; ++i) {
    axis[i] = carver_test::real(random_, -1, 1);
    shift[i] = is_exact ? below(9) - 4 : axis[i];
  }
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  if (is_exact && below(2) == 0) turn << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  if (is_exact && below(2) == 0) turn = turn * Eigen::Vector3d(-1, -1, 1).asDiagonal();
  if (!is_exact) turn = Eigen::AngleAxisd(3 * axis.norm(), axis.normalized()).toRotationMatrix();
  const double size =
      is_exact ? std::ldexp(1.0, below(3) - 1) : carver_test::real(random_, 0.7, 1.4);
  return Eigen::Translation3d(scale_ * shift) * Eigen::Affine3d(scale_ * size * turn);
}

MapDelta MapGenerator::close_loop() {
  const Eigen::Affine3d corrected = random_similarity();
  const Eigen::Affine3d correction = corrected * map_from_layout_.inverse();
  map_from_layout_ = corrected;
  MapDelta delta;
  for (const auto& [id, centre] : model_.cameras) {
    delta.keyframes_set.push_back(keyframe_at(id, correction * centre));
  }
  for (const auto& [id, position] : model_.points) {
    delta.points_set.push_back({id, (correction * position.cast<double>()).cast<float>()});
  }
  return applied(std::move(delta));
}

}  // namespace foresight::carver_test
