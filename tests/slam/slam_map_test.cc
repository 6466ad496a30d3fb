#include "procs/slam/slam_map.h"

#include <gtest/gtest.h>

#include "procs/slam/published_map.h"
#include "tests/slam/synthetic_scene.h"

namespace foresight::slam {
namespace {

Corner corner_of(KeyframeId keyframe_id) {
  Corner corner;
  corner.keyframe_id = keyframe_id;
  corner.pixel = {10, 10};
  corner.ray = {0, 0, 1};
  return corner;
}

class SlamMapTest : public testing::Test {
 protected:
  void SetUp() override {
    for (int i = 0; i < 3; ++i) map_.add_keyframe(Keyframe{});
    point_ = map_.add_point({0, 0, 2}, corner_of(KeyframeId(0)));
    map_.add_observation(point_, {KeyframeId(1), 0, {5, 5}, {0, 0}});
  }
  SlamMap map_;
  PointId point_;
};

TEST_F(SlamMapTest, KeepsBothSidesOfAnObservation) {
  map_.validate();
  EXPECT_TRUE(map_.keyframe(KeyframeId(1))->point_ids.contains(point_));
  map_.remove_observation(point_, KeyframeId(1));
  map_.validate();
  EXPECT_FALSE(map_.keyframe(KeyframeId(1))->point_ids.contains(point_));
  map_.remove_point(point_);
  map_.validate();
  EXPECT_TRUE(map_.points().empty());
}

TEST_F(SlamMapTest, NeverReusesAnId) {
  map_.remove_point(point_);
  EXPECT_NE(map_.add_point({0, 0, 3}, corner_of(KeyframeId(1))), point_);
}

TEST_F(SlamMapTest, DeltasHoldBackProbationAndSmallMoves) {
  PublishedMap stream(test_camera(), SlamOptions{});
  EXPECT_EQ(stream.take(&map_).points_set.size(), 0u);
  map_.confirm_point(point_);
  const MapDelta first = stream.take(&map_);
  EXPECT_EQ(first.points_set.size(), 1u);
  EXPECT_EQ(first.observations_added.size(), 2u);
  map_.move_point(point_, {0, 0, 2.0001});
  EXPECT_TRUE(stream.take(&map_).empty());
  map_.move_point(point_, {0, 0, 2.1});
  EXPECT_EQ(stream.take(&map_).points_set.size(), 1u);
  map_.remove_point(point_);
  EXPECT_EQ(stream.take(&map_).points_removed, std::vector<PointId>{point_});
  EXPECT_TRUE(stream.snapshot().points_set.empty());
}

}  // namespace
}  // namespace foresight::slam
