// Degenerate and awkward maps: any scale, the hull, coincident points, cameras on vertices.
#include <gtest/gtest.h>

#include "procs/carver/carver.h"
#include "tests/carver/brute_force.h"
#include "tests/common/plain_ids.h"

namespace foresight::carver_test {
namespace {

Carving carve_all(const MapModel& map, const CarverOptions& options = {}) {
  Carver carver(options);
  Receiver receiver;
  EXPECT_EQ(receiver.apply(carver.apply(map.whole())), "");
  return receiver.carving();
}

void expect_exact(Carver& carver, Receiver& receiver, const MapModel& map) {
  ASSERT_EQ(differences(receiver.carving(), carve_by_brute_force(map, receiver.vertices())), "");
  ASSERT_EQ(carver.validate(), "");
}

TEST(Scale, DoesNotChangeTheResult) {
  for (const Layout layout : {Layout::kGeneral, Layout::kLattice, Layout::kPlane}) {
    MapGenerator unit(layout, 21);
    for (int step = 0; step < 25; ++step) unit.next();
    const Carving expected = carve_all(unit.model());
    EXPECT_GT(expected.size(), 50U);
    std::vector<double> scales{0x1p-10, 0x1p10, 0x1p-30, 0x1p20};
    if (layout == Layout::kGeneral) scales.insert(scales.end(), {1e-3, 1e3});  // rounds
    for (const double scale : scales) {
      MapGenerator scaled(layout, 21, scale);
      for (int step = 0; step < 25; ++step) scaled.next();
      EXPECT_EQ(differences(carve_all(scaled.model()), expected), "") << "scale " << scale;
    }
  }
}

TEST(Lattice, ConstraintsAlongEdgesAndFacetsAreNotCutShort) {
  MapModel map;
  int32_t id = 0;
  for (int x = 0; x < 4; ++x) {
    for (int y = 0; y < 4; ++y) {
      for (int z = 0; z < 4; ++z)
        map.points[PointId(id++)] = Eigen::Vector3i(x, y, z).cast<float>();
    }
  }
  const std::vector<Eigen::Vector3d> centres{{-2, 1, 1},    {1.5, 1.5, 1.5}, {1.5, 1, 1},
                                             {1.5, 1.5, 1}, {0, 0, 0},       {5, 5, 5}};
  for (const auto& centre : centres) {
    const auto keyframe = KeyframeId::at(map.cameras.size());
    map.cameras[keyframe] = centre;
    for (int32_t point = 0; point < id; ++point) {
      map.observations.insert({keyframe, PointId(point)});
    }
  }
  Carver carver;
  Receiver receiver;
  ASSERT_EQ(receiver.apply(carver.apply(map.whole())), "");
  expect_exact(carver, receiver, map);
  // Each removal turns constraints that grazed into ones that cross.
  for (const int32_t gone : {21, 26, 42}) {
    MapDelta delta;
    delta.points_removed = ids<PointId>({gone});
    map.apply(delta);
    ASSERT_EQ(receiver.apply(carver.apply(delta)), "");
    expect_exact(carver, receiver, map);
  }
}

TEST(Hull, GrowsWithTheMapAndLosesNothing) {
  MapGenerator generator(Layout::kGeneral, 31);
  for (const double fixed : {0.0, 20.0}) {
    CarverOptions options;
    options.hull_half_size_mu = fixed;
    Carver carver(options);
    Receiver receiver;
    MapModel map;
    MapDelta delta;
    delta.keyframes_set = {keyframe_at(0, {0, 0, 0})};
    delta.points_set = points({{0, {1, 0, 0}}, {1, {0, 1, 0}}, {2, {0, 0, 1}}, {3, {1, 1, 1}}});
    delta.observations_added = seen({{0, 0}, {0, 1}, {0, 2}, {0, 3}});
    map.apply(delta);
    ASSERT_EQ(receiver.apply(carver.apply(delta)), "");
    expect_exact(carver, receiver, map);
    for (int32_t step = 1; step < 6; ++step) {
      MapDelta far;
      const float distance = std::pow(20.F, static_cast<float>(step));
      far.points_set = points({{3 + step, {distance, 1.F, -distance}}});
      far.keyframes_set = {keyframe_at(step, {-distance, 0.0, 3.0})};
      far.observations_added = seen({{0, 3 + step}, {step, 3 + step}, {step, 0}});
      map.apply(far);
      ASSERT_EQ(receiver.apply(carver.apply(far)), "");
      expect_exact(carver, receiver, map);
    }
    EXPECT_EQ(carver.statistics().last_rebuild, RebuildReason::kHullOutgrown);
    EXPECT_EQ(carver.statistics().vertices, 9);
  }
}

TEST(Hull, WaitsForASecondPosition) {
  Carver carver;
  MapModel map;
  MapDelta delta;
  delta.keyframes_set = {keyframe_at(0, {1, 2, 3})};
  EXPECT_TRUE(carver.apply(delta).empty());
  delta.points_set = points({{0, {1, 2, 3}}});
  delta.observations_added = seen({{0, 0}});
  EXPECT_TRUE(carver.apply(delta).empty());
  map.apply(delta);
  MapDelta second;
  second.points_set = points({{1, {2, 2, 3}}});
  second.observations_added = seen({{0, 1}});
  map.apply(second);
  Receiver receiver;
  ASSERT_EQ(receiver.apply(carver.apply(second)), "");
  expect_exact(carver, receiver, map);
  MapDelta gone;
  gone.points_removed = ids<PointId>({0, 1});
  map.apply(gone);
  ASSERT_EQ(receiver.apply(carver.apply(gone)), "");
  expect_exact(carver, receiver, map);
}

// Of a map that shrinks to one position, far from where it was: the corners are floats.
TEST(Hull, FollowsALonelyPointFarAway) {
  Carver carver;
  Receiver receiver;
  MapModel map;
  MapDelta delta;
  delta.points_set = points({{0, {0, 0, 0}}, {1, {0.1F, 0, 0}}});
  map.apply(delta);
  ASSERT_EQ(receiver.apply(carver.apply(delta)), "");
  MapDelta leaves;
  leaves.points_removed = ids<PointId>({0});
  leaves.points_set = points({{1, {0, 0, 3e8F}}});
  map.apply(leaves);
  ASSERT_EQ(receiver.apply(carver.apply(leaves)), "");
  expect_exact(carver, receiver, map);
}

// Half edges that no float holds: what is inside before the corners are rounded is to be so after.
TEST(Hull, HoldsWhatLiesOnARoundedFaceStrictly) {
  for (const double half_size : {530.72933197, 0.1, 1e-3, 7.7e5}) {
    CarverOptions options;
    options.hull_half_size_mu = half_size;
    Carver carver(options);
    Receiver receiver;
    MapModel map;
    MapDelta delta;
    const auto face = static_cast<float>(half_size);
    delta.points_set =
        points({{0, {0, 0, 0}}, {1, {face, 0, 0}}, {2, {0, std::nextafter(face, 0.F), 0}}});
    map.apply(delta);
    ASSERT_EQ(receiver.apply(carver.apply(delta)), "") << half_size;
    expect_exact(carver, receiver, map);
  }
}

TEST(CoincidentPoints, ShareAVertexNamedByTheSmallestId) {
  Carver carver;
  Receiver receiver;
  MapModel map;
  const auto apply = [&](const MapDelta& delta) {
    map.apply(delta);
    ASSERT_EQ(receiver.apply(carver.apply(delta)), "");
    expect_exact(carver, receiver, map);
  };
  MapDelta delta;
  delta.keyframes_set = {keyframe_at(0, {0, 0, 0}), keyframe_at(1, {0, 0.1, 0})};
  delta.points_set = points({{5, {1, 0, 0}}, {6, {0, 1, 1}}, {7, {1, 0, 0}}, {8, {1, 1, 0}}});
  delta.observations_added = seen({{0, 5}, {0, 7}, {1, 7}, {0, 6}, {1, 8}});
  apply(delta);
  EXPECT_EQ(carver.statistics().vertices, 3);
  EXPECT_TRUE(receiver.vertices().contains(VertexId(5)));
  EXPECT_FALSE(receiver.vertices().contains(VertexId(7)));
  MapDelta smaller;
  smaller.points_set = points({{2, {1, 0, 0}}});
  apply(smaller);
  EXPECT_TRUE(receiver.vertices().contains(VertexId(2)));
  MapDelta owner_leaves;
  owner_leaves.points_removed = ids<PointId>({2});
  owner_leaves.points_set = points({{5, {0.5, 0.5, 0.5}}});
  apply(owner_leaves);
  EXPECT_TRUE(receiver.vertices().contains(VertexId(7)));
  MapDelta rejoin;
  rejoin.points_set = points({{5, {1, 0, 0}}, {6, {1, 0, 0}}});
  apply(rejoin);
  EXPECT_EQ(carver.statistics().vertices, 2);
}

}  // namespace
}  // namespace foresight::carver_test
