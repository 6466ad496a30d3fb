// A plain model of the SLAM map that follows MapDelta's contract, and random changes to it.
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "common/map_delta.h"
#include "tests/carver/map_layouts.h"

namespace foresight::carver_test {

struct MapModel {
  std::map<KeyframeId, Eigen::Vector3d> cameras;
  std::map<PointId, Eigen::Vector3f> points;
  std::set<MapObservation> observations;

  /// Ignores what is unknown, repeated or absurd, as the carver must.
  void apply(const MapDelta& delta);
  /// The delta that makes this map from nothing.
  MapDelta whole() const;
};

/// Random deltas to a map of a few dozen points; each is applied to `model()` too.
///
///   MapGenerator generator(Layout::kLattice, seed);
///   carver.apply(generator.next());
class MapGenerator {
 public:
  /// Places are multiplied by `scale` and lie around a point `offset` scaled units away.
  MapGenerator(Layout layout, uint32_t seed, double scale = 1.0, double offset = 0.0);

  /// A small change: insertions, deletions, moves, lost observations.
  MapDelta next();
  /// A small change among entries that nobody should send: see add_hostile_entries().
  MapDelta next_hostile();
  /// A loop is closed: all points and keyframes move by one similarity, new ones follow it. Half of
  /// the similarities are exact, so that lattices and planes remain such.
  MapDelta close_loop();
  /// Many points, keyframes and observations at once.
  MapDelta grow_much();
  /// All points go, or all keyframes, or both.
  MapDelta remove_all();
  /// The last delta once more.
  MapDelta repeat_last();
  /// A new epoch: an empty map, ids from 0 again. Whoever follows the deltas starts over, too.
  void start_over();

  const MapModel& model() const { return model_; }

 private:
  int below(int bound);
  Eigen::Vector3d place(Placed what);
  Eigen::Affine3d random_similarity();
  MapDelta draw();
  MapDelta applied(MapDelta delta);
  void add_keyframe(MapDelta& delta);
  void add_points(MapDelta& delta, int count);
  void add_observations(MapDelta& delta, int count);
  void remove_some(MapDelta& delta);
  void move_some(MapDelta& delta);
  template <class Map>
  typename Map::key_type pick(const Map& map);

  Layout layout_;
  double scale_;
  Eigen::Affine3d map_from_layout_;
  std::mt19937 random_;
  MapModel model_;
  MapDelta last_;
  PointId next_point_{0};
  KeyframeId next_keyframe_{0};
};

MapKeyframe keyframe_at(KeyframeId id, const Eigen::Vector3d& centre);
MapKeyframe keyframe_at(int32_t id, const Eigen::Vector3d& centre);

}  // namespace foresight::carver_test
