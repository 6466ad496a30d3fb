// A plain model of the SLAM map that follows MapDelta's contract, and random changes to it.
#pragma once

#include <map>
#include <random>
#include <set>
#include <vector>

#include "common/map_delta.h"

namespace foresight::carver_test {

struct MapModel {
  std::map<int32_t, Eigen::Vector3d> cameras;
  std::map<int32_t, Eigen::Vector3f> points;
  std::set<MapObservation> observations;

  /// Ignores what is unknown or repeated, as the carver must.
  void apply(const MapDelta& delta);
  /// The delta that makes this map from nothing.
  MapDelta whole() const;
};

/// Where random points and cameras lie.
enum class Layout {
  kGeneral,  // anywhere
  kLattice,  // small whole numbers; cameras there too, on edges, facets and vertices
  kPlane,    // points on one plane, some cameras on it
};

class MapGenerator {
 public:
  MapGenerator(Layout layout, uint32_t seed, double scale = 1.0)
      : layout_(layout), scale_(scale), random_(seed) {}

  /// A random change: insertions, deletions, moves, lost observations; applied to `model` too.
  MapDelta next();
  const MapModel& model() const { return model_; }

 private:
  int below(int bound) { return static_cast<int>(random_() % static_cast<uint32_t>(bound)); }
  double real(double low, double high);
  Eigen::Vector3d place(bool camera);
  void add_keyframe(MapDelta& delta);
  void add_points(MapDelta& delta, int count);
  void add_observations(MapDelta& delta, int count);
  void remove_some(MapDelta& delta);
  void move_some(MapDelta& delta);
  template <class Map>
  int32_t pick(const Map& map);

  Layout layout_;
  double scale_;
  std::mt19937 random_;
  MapModel model_;
  int32_t next_point_ = 0, next_keyframe_ = 0;
};

MapKeyframe keyframe_at(int32_t id, const Eigen::Vector3d& centre);

}  // namespace foresight::carver_test
