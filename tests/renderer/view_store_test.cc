#include "procs/renderer/view_store.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace foresight {
namespace {

CameraModel camera() {
  CameraModel c;
  c.width_px = 640;
  c.height_px = 480;
  c.fx_px = c.fy_px = 500;
  c.cx_px = 319.5;
  c.cy_px = 239.5;
  return c;
}

Pose<Map, Cam> at(double x, double right_rad = 0) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(right_rad, Eigen::Vector3d::UnitY())),
          Eigen::Vector3d(x, 0, 0)};
}

void insert(ViewStore* store, int64_t id, const Pose<Map, Cam>& pose) {
  store->insert(id, Time{id * 1000}, camera(), pose, 1.0);
}

TEST(ViewStoreTest, StillCameraKeepsTwoViewsAndTheNewestIsFresh) {
  ViewStore store(24);
  for (int id = 1; id <= 100; ++id) insert(&store, id, at(0));
  EXPECT_EQ(store.size(), 2);
  EXPECT_NE(store.find(100), nullptr);
  EXPECT_NE(store.find(99), nullptr);
}

TEST(ViewStoreTest, SlowCameraLeavesATrail) {
  ViewStore store(24);
  for (int id = 1; id <= 1000; ++id) insert(&store, id, at(0.001 * id));  // 1 unit in all
  EXPECT_GE(store.size(), 8);
  double smallest = 1;
  for (const StoredView& view : store.views()) {
    smallest = std::min(smallest, view.map_from_cam.translation().x());
  }
  EXPECT_LT(smallest, ViewStore::kSamePlace * 1.01);
}

TEST(ViewStoreTest, CapacityHoldsAndSlotsAreUnique) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(-5, 5);
  ViewStore store(10);
  for (int id = 1; id <= 500; ++id) {
    insert(&store, id % 3 == 0 ? id - 2 : id, at(place(random), place(random)));
    ASSERT_LE(store.size(), 10);
    std::set<int> slots;
    for (const StoredView& view : store.views()) slots.insert(view.slot);
    ASSERT_EQ(slots.size(), store.views().size());
    ASSERT_GE(*slots.begin(), 0);
    ASSERT_LT(*slots.rbegin(), 10);
  }
}

TEST(ViewStoreTest, FullStoreStaysSpreadOut) {
  ViewStore store(6);
  for (int id = 1; id <= 60; ++id) insert(&store, id, at(0.1 * id));
  double low = 1e9, high = 0;
  for (const StoredView& view : store.views()) {
    low = std::min(low, view.map_from_cam.translation().x());
    high = std::max(high, view.map_from_cam.translation().x());
  }
  EXPECT_LT(low, 1.0);
  EXPECT_DOUBLE_EQ(high, 6.0);
}

TEST(ViewStoreTest, NewestComesFirstThenTheNearest) {
  ViewStore store(24);
  insert(&store, 1, at(-3));
  insert(&store, 2, at(1.2));
  insert(&store, 3, at(3));
  insert(&store, 9, at(0));
  insert(&store, 4, at(2));  // late: older than the newest
  ViewQuery query{at(1), camera(), nullptr, 1.0, 3};
  const std::vector<StoredView*> chosen = store.select(query);
  ASSERT_EQ(chosen.size(), 3u);
  EXPECT_EQ(chosen[0]->id, 9);
  EXPECT_EQ(chosen[1]->id, 2);
  EXPECT_EQ(chosen[2]->id, 4);
}

/// The predicted camera turned right: the view that covers the right part wins against a nearer one
/// that sees no more than the newest.
TEST(ViewStoreTest, CoverageOfWhatTheNewestMissesCounts) {
  std::vector<Eigen::Vector3f> wall;
  for (int i = -40; i <= 40; ++i) wall.emplace_back(0.1f * static_cast<float>(i), 0.0f, 2.0f);
  ViewStore store(24);
  insert(&store, 1, at(0, 0.1));
  insert(&store, 2, at(0.2, 0.9));
  insert(&store, 3, at(0, 0));
  ViewQuery query{at(0, 0.45), camera(), &wall, 1.0, 2};
  const std::vector<StoredView*> chosen = store.select(query);
  ASSERT_EQ(chosen.size(), 2u);
  EXPECT_EQ(chosen[0]->id, 3);
  EXPECT_EQ(chosen[1]->id, 2);
}

TEST(ViewStoreTest, CapacityOneKeepsTheNewest) {
  ViewStore store(1);
  insert(&store, 1, at(0));
  insert(&store, 2, at(1));
  ASSERT_EQ(store.size(), 1);
  EXPECT_NE(store.find(2), nullptr);
}

TEST(ViewStoreTest, AKnownIdIsReplaced) {
  ViewStore store(4);
  insert(&store, 1, at(0));
  insert(&store, 1, at(1));
  ASSERT_EQ(store.size(), 1);
  EXPECT_DOUBLE_EQ(store.find(1)->map_from_cam.translation().x(), 1);
}

}  // namespace
}  // namespace foresight
