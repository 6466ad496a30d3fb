// A carver with a memory limit: what goes, what stays, and that the rest is exact.
#include <gtest/gtest.h>

#include <random>

#include "procs/carver/carver.h"
#include "tests/carver/map_model.h"
#include "tests/carver/receiver.h"

namespace foresight::carver_test {
namespace {

constexpr int kPoints = 200;

/// Points in a room, and keyframe after keyframe that sees all of them.
class GrowingMap {
 public:
  MapDelta first() {
    MapDelta delta = next();
    for (int32_t id = 0; id < kPoints; ++id) {
      delta.points_set.push_back({PointId(id), Eigen::Vector3f(real(), real(), real())});
    }
    return delta;
  }
  MapDelta next() {
    MapDelta delta;
    const KeyframeId keyframe(keyframes_++);
    delta.keyframes_set.push_back(
        keyframe_at(keyframe, 0.3 * Eigen::Vector3d(real(), real(), real())));
    for (int32_t id = 0; id < kPoints; ++id) {
      delta.observations_added.push_back({keyframe, PointId(id)});
    }
    return delta;
  }
  int keyframes() const { return keyframes_; }

 private:
  float real() { return std::uniform_real_distribution<float>(-1, 1)(random_); }
  std::mt19937 random_{5};
  int32_t keyframes_ = 0;
};

int64_t memory_of(int keyframes) {
  GrowingMap map;
  Carver carver;
  carver.apply(map.first());
  while (map.keyframes() < keyframes) carver.apply(map.next());
  return carver.statistics().memory_bytes;
}

TEST(MemoryLimit, IsKeptWhileTheMapGrows) {
  CarverOptions options;
  options.memory_limit_bytes = memory_of(30);
  Carver carver(options);
  Receiver receiver;
  GrowingMap map;
  ASSERT_EQ(receiver.apply(carver.apply(map.first())), "");
  while (map.keyframes() < 100) {
    ASSERT_EQ(receiver.apply(carver.apply(map.next())), "");
    const CarverStatistics s = carver.statistics();
    ASSERT_LE(s.memory_bytes, options.memory_limit_bytes) << map.keyframes();
    ASSERT_FALSE(s.over_memory_limit);
  }
  const CarverStatistics s = carver.statistics();
  EXPECT_EQ(s.constraints + s.thinned_constraints, 100 * kPoints);
  EXPECT_GT(s.thinned_constraints, 60 * kPoints);
  EXPECT_GE(s.constraints, 4 * kPoints);
  EXPECT_EQ(carver.validate(), "");
  Receiver late;
  ASSERT_EQ(late.apply(carver.snapshot()), "");
  EXPECT_EQ(late.carving(), receiver.carving());
}

TEST(MemoryLimit, OldestConstraintsGoFirst) {
  CarverOptions options;
  options.memory_limit_bytes = memory_of(60);
  Carver limited(options), anew;
  Receiver receiver, expected;
  GrowingMap map;
  MapDelta whole = map.first();
  ASSERT_EQ(receiver.apply(limited.apply(whole)), "");
  while (limited.statistics().thinned_constraints == 0) {
    const MapDelta delta = map.next();
    ASSERT_EQ(receiver.apply(limited.apply(delta)), "");
    whole.keyframes_set.push_back(delta.keyframes_set.front());
    whole.observations_added.insert(whole.observations_added.end(),
                                    delta.observations_added.begin(),
                                    delta.observations_added.end());
  }
  const auto thinned = static_cast<std::ptrdiff_t>(limited.statistics().thinned_constraints);
  ASSERT_LT(thinned, 56 * kPoints);               // points keep more than four
  auto& observations = whole.observations_added;  // in the order of their keyframes
  observations.erase(observations.begin(), observations.begin() + thinned);
  ASSERT_EQ(expected.apply(anew.apply(whole)), "");
  EXPECT_EQ(differences(receiver.carving(), expected.carving()), "");
}

TEST(MemoryLimit, WhatWasThinnedCanStillBeRemoved) {
  CarverOptions options;
  options.memory_limit_bytes = memory_of(10);
  Carver carver(options);
  GrowingMap map;
  carver.apply(map.first());
  while (map.keyframes() < 30) carver.apply(map.next());
  ASSERT_GT(carver.statistics().thinned_constraints, 0);
  MapDelta removal;
  removal.observations_removed.push_back({KeyframeId(0), PointId(0)});
  removal.points_removed.emplace_back(1);
  for (int32_t keyframe = 1; keyframe < 25; ++keyframe) {
    removal.keyframes_removed.emplace_back(keyframe);
  }
  removal.observations_removed.push_back(
      {KeyframeId(1000), PointId(0)});  // this keyframe was never known
  carver.apply(removal);
  EXPECT_EQ(carver.statistics().ignored_inputs, 1);
  EXPECT_EQ(carver.validate(), "");
}

/// A map that is loaded comes as one delta.
TEST(MemoryLimit, IsKeptByASingleDelta) {
  GrowingMap map;
  MapDelta whole = map.first();
  while (map.keyframes() < 60) {
    const MapDelta delta = map.next();
    whole.keyframes_set.push_back(delta.keyframes_set.front());
    whole.observations_added.insert(whole.observations_added.end(),
                                    delta.observations_added.begin(),
                                    delta.observations_added.end());
  }
  CarverOptions options;
  options.memory_limit_bytes = memory_of(50);
  Carver carver(options);
  Receiver receiver;
  ASSERT_EQ(receiver.apply(carver.apply(whole)), "");
  const CarverStatistics s = carver.statistics();
  EXPECT_LE(s.memory_bytes, options.memory_limit_bytes);
  EXPECT_FALSE(s.over_memory_limit);
  EXPECT_GT(s.thinned_constraints, 0);
  EXPECT_EQ(carver.validate(), "");
}

TEST(MemoryLimit, ThatCannotBeMetIsSaid) {
  CarverOptions options;
  options.memory_limit_bytes = 1000;
  Carver carver(options);
  GrowingMap map;
  carver.apply(map.first());
  while (map.keyframes() < 10) carver.apply(map.next());
  const CarverStatistics s = carver.statistics();
  EXPECT_TRUE(s.over_memory_limit);
  EXPECT_EQ(s.constraints, kPoints);  // each point keeps its newest
  EXPECT_EQ(carver.validate(), "");
}

}  // namespace
}  // namespace foresight::carver_test
