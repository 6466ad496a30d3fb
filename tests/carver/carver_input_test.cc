// Bad input is ignored and counted; entries may come twice; reset forgets.
#include <gtest/gtest.h>

#include <limits>

#include "procs/carver/carver.h"
#include "tests/carver/brute_force.h"
#include "tests/common/plain_ids.h"

namespace foresight::carver_test {
namespace {

MapDelta small_map() {
  MapDelta delta;
  delta.keyframes_set = {keyframe_at(0, {0, 0, 0})};
  delta.points_set = points({{0, {1, 0, 0}}, {1, {0, 1, 0}}, {2, {0, 0, 1}}, {3, {1, 1, 1}}});
  delta.observations_added = seen({{0, 0}, {0, 1}, {0, 3}});
  return delta;
}

TEST(BadInput, IsIgnoredAndCounted) {
  Carver carver;
  carver.apply(small_map());
  ASSERT_EQ(carver.statistics().ignored_inputs, 0);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  MapDelta bad;
  bad.observations_removed = seen({{0, 2}, {7, 0}, {0, 99}});  // never seen, unknown, unknown
  bad.points_removed = ids<PointId>({99, -1});                 // unknown
  bad.keyframes_removed = ids<KeyframeId>({5, -3});            // unknown
  bad.keyframes_set = {keyframe_at(-1, {1, 1, 1}), keyframe_at(1, {infinite, 0, 0})};
  bad.points_set =
      points({{-4, {0, 0, 0}}, {4, {nan, 0, 0}}, {5, {1e30F, 0, 0}}, {0, {nan, nan, nan}}});
  bad.observations_added = seen({{0, 0}, {1, 0}, {0, 4}, {-1, -1}});  // repeated, unknown ×3
  EXPECT_TRUE(carver.apply(bad).empty());
  EXPECT_EQ(carver.statistics().ignored_inputs, 3 + 2 + 2 + 2 + 4 + 4);
  EXPECT_EQ(carver.validate(), "");
}

TEST(BadInput, AppliedTwiceIsHarmless) {
  Carver carver;
  Receiver receiver;
  ASSERT_EQ(receiver.apply(carver.apply(small_map())), "");
  EXPECT_TRUE(carver.apply(small_map()).empty());
  EXPECT_EQ(carver.statistics().ignored_inputs, 3);  // the observations are known
  MapDelta twice;
  twice.points_set =
      points({{9, {2, 2, 2}}, {9, {0.5, 0.5, 0.5}}, {0, {3, 0, 0}}, {0, {1, 0, 0.1F}}});
  twice.observations_added = seen({{0, 9}});
  MapModel map;
  map.apply(small_map());
  map.apply(twice);
  ASSERT_EQ(receiver.apply(carver.apply(twice)), "");
  EXPECT_EQ(differences(receiver.carving(), carve_by_brute_force(map, receiver.vertices())), "");
}

TEST(BadInput, GarbageNeverCrashes) {
  std::mt19937 random(77);
  const auto id = [&] { return static_cast<int32_t>(random() % 12) - 2; };
  const auto number = [&]() -> float {
    constexpr std::array<float, 8> kOdd{0.F, -0.F, 1e-45F, 1e-20F, 3e8F, -1.F, 1.F, 1e38F};
    return random() % 2 == 0 ? kOdd[random() % kOdd.size()]
                             : static_cast<float>(random() % 1000) * 1e-3F;
  };
  Carver carver;
  Receiver receiver;
  for (int step = 0; step < 150; ++step) {
    MapDelta delta;
    if (random() % 3 == 0) delta.observations_removed = seen({{id(), id()}, {id(), id()}});
    if (random() % 5 == 0) delta.points_removed = ids<PointId>({id(), id()});
    if (random() % 9 == 0) delta.keyframes_removed = ids<KeyframeId>({id()});
    const Eigen::Vector3f centre(number(), number(), number());
    delta.keyframes_set = {keyframe_at(id(), centre.cast<double>())};
    delta.points_set =
        points({{id(), {number(), number(), number()}}, {id(), {number(), 0.F, 0.F}}});
    delta.observations_added = seen({{id(), id()}, {id(), id()}, {id(), id()}});
    ASSERT_EQ(receiver.apply(carver.apply(delta)), "") << "step " << step;
    if (step % 10 == 9) {
      ASSERT_EQ(carver.validate(), "") << "step " << step;
    }
  }
}

TEST(Reset, ForgetsEverything) {
  Carver carver;
  carver.apply(small_map());
  carver.reset();
  EXPECT_TRUE(carver.snapshot().empty());
  EXPECT_EQ(carver.statistics().cells, 0);
  Receiver receiver;
  EXPECT_EQ(receiver.apply(carver.apply(small_map())), "");
  EXPECT_FALSE(receiver.cells().empty());
}

TEST(Unobserved, PointIsAVertex) {
  Carver carver;
  Receiver receiver;
  ASSERT_EQ(receiver.apply(carver.apply(small_map())), "");
  EXPECT_TRUE(receiver.vertices().contains(VertexId(2)));  // nobody saw it
}

}  // namespace
}  // namespace foresight::carver_test
