// What the calibrator collects: joints, map, pairs.
#include <gtest/gtest.h>

#include "procs/calibrator/pair_collector.h"

namespace foresight {
namespace {

using namespace calibration;
using Eigen::Quaterniond;
using Eigen::Vector3d;

Time at_ms(int64_t ms) { return Time{5'000'000} + milliseconds(ms); }
Pose<Base, Ee> hand_at(double x_m) { return {Quaterniond::Identity(), Vector3d(x_m, 0, 0)}; }

TEST(ArmHistory, InterpolatesBetweenReadings) {
  ArmHistory history({});
  EXPECT_FALSE(history.at(at_ms(0)));
  for (int i = 0; i <= 10; ++i)
    EXPECT_EQ(history.add(at_ms(10 * i), hand_at(0.01 * i)), ArmHistory::Added::kAdded);
  const auto motion = history.at(at_ms(34));
  ASSERT_TRUE(motion);
  EXPECT_NEAR(motion->base_from_ee.translation().x(), 0.034, 1e-12);
  EXPECT_NEAR(motion->velocity_m_per_s.x(), 1, 1e-9);
  EXPECT_TRUE(history.at(at_ms(0)));
  EXPECT_TRUE(history.at(at_ms(100)));
  EXPECT_FALSE(history.at(at_ms(101)));
  EXPECT_FALSE(history.at(at_ms(-1)));
}

TEST(ArmHistory, DoesNotBridgeGapsJumpsOrOldReadings) {
  ArmHistory history({});
  history.add(at_ms(0), hand_at(0));
  history.add(at_ms(10), hand_at(0));
  history.add(at_ms(200), hand_at(0));
  EXPECT_FALSE(history.at(at_ms(100)));
  EXPECT_EQ(history.add(at_ms(199), hand_at(0)), ArmHistory::Added::kNotNewer);
  EXPECT_EQ(history.add(at_ms(210), hand_at(0.5)), ArmHistory::Added::kDoubted);
  EXPECT_EQ(history.add(at_ms(220), hand_at(0.5)), ArmHistory::Added::kJump);
  EXPECT_FALSE(history.at(at_ms(205)));
  EXPECT_TRUE(history.at(at_ms(215)));
  EXPECT_EQ(history.oldest(), at_ms(210));
}

TEST(ArmHistory, AForgedReadingAmongGenuineOnesChangesNothing) {
  ArmHistory history({});
  for (int i = 0; i <= 10; ++i) {
    EXPECT_EQ(history.add(at_ms(10 * i), hand_at(0)), ArmHistory::Added::kAdded);
    EXPECT_EQ(history.add(at_ms(10 * i + 5), hand_at(0.4 + i)), ArmHistory::Added::kDoubted);
  }
  EXPECT_EQ(history.oldest(), at_ms(0));
  EXPECT_TRUE(history.at(at_ms(55)));
}

TEST(ArmHistory, GivesAWindowOnlyWhenItIsWhole) {
  ArmHistory history({});
  for (int i = 0; i <= 30; ++i) history.add(at_ms(10 * i), hand_at(0.001 * i));
  EXPECT_FALSE(history.around(at_ms(100), milliseconds(120)));
  EXPECT_FALSE(history.around(at_ms(200), milliseconds(120)));
  const auto track = history.around(at_ms(155), milliseconds(120));
  ASSERT_TRUE(track);
  EXPECT_NEAR(track->at(0).base_from_ee.translation().x(), 0.0155, 1e-12);
  EXPECT_NEAR(track->at(-0.1).base_from_ee.translation().x(), 0.0055, 1e-12);
  EXPECT_NEAR(track->at(0.13).base_from_ee.translation().x(), 0.0285, 1e-9) << "prolonged";
}

class PairCollectorTest : public testing::Test {
 protected:
  void move_arm(int from_ms, int to_ms) {
    for (int ms = from_ms; ms <= to_ms; ms += 10) arm_.add(at_ms(ms), hand_at(1e-4 * ms));
    collector_.update();
  }
  static Pose<Map, Cam> pose(double x_mu) {
    return {Quaterniond::Identity(), Vector3d(x_mu, 0, 0)};
  }
  void set_keyframe(int32_t id, double x_mu, int ms) {
    MapDelta delta;
    delta.keyframes_set.push_back({KeyframeId(id), pose(x_mu), at_ms(ms)});
    map_.apply(delta);
    collector_.add_keyframes(delta);
  }
  ArmHistory arm_{{}};
  MapStore map_;
  PairCollector collector_{{}, arm_, map_};
};

TEST_F(PairCollectorTest, WaitsForJointsAroundTheImage) {
  move_arm(0, 600);
  set_keyframe(0, 0, 500);
  collector_.update();
  EXPECT_EQ(collector_.size(), 0);
  move_arm(610, 700);
  EXPECT_EQ(collector_.size(), 1);
  set_keyframe(1, 0, -3000);  // before the joints began
  move_arm(710, 800);
  EXPECT_EQ(collector_.size(), 1);
}

TEST_F(PairCollectorTest, PairsFollowBundleAdjustment) {
  move_arm(0, 2000);
  set_keyframe(0, 1, 500);
  collector_.update();
  collector_.add_frame(at_ms(900), pose(1.5));
  collector_.update();
  set_keyframe(0, 2, 500);
  const auto pairs = collector_.pairs();
  ASSERT_EQ(pairs.size(), 2u);
  EXPECT_EQ(pairs[0].map_from_cam.translation().x(), 2);
  EXPECT_EQ(pairs[1].map_from_cam.translation().x(), 2.5) << "a frame moves with its keyframe";
}

// Else, after an hour of a map that renews itself, all places would be held by what is gone.
TEST_F(PairCollectorTest, RemovedKeyframesHoldNoPlace) {
  move_arm(0, 2000);
  set_keyframe(0, 1, 500);
  set_keyframe(1, 2, 900);
  collector_.add_frame(at_ms(700), pose(1.1));
  collector_.update();
  ASSERT_EQ(collector_.size(), 3);
  MapDelta delta;
  delta.keyframes_removed = {KeyframeId(0)};
  map_.apply(delta);
  collector_.update();
  EXPECT_EQ(collector_.size(), 1);
  EXPECT_EQ(collector_.pairs().size(), 1u);
}

TEST_F(PairCollectorTest, KeyframesOfAMovingBaseNeverComeBack) {
  move_arm(0, 5000);
  MapDelta delta;
  delta.keyframes_set.push_back({KeyframeId(7), pose(0), at_ms(1000)});
  map_.apply(delta);
  collector_.exclude_keyframes(delta);
  set_keyframe(7, 0.1, 1000);  // bundle adjustment sends it again
  collector_.update();
  EXPECT_EQ(collector_.size(), 0);
  set_keyframe(8, 0, 2000);
  set_keyframe(9, 0, 3000);
  collector_.update();
  collector_.discard_after(at_ms(2500));
  set_keyframe(9, 0.1, 3000);
  collector_.update();
  EXPECT_EQ(collector_.size(), 1);
  collector_.discard_before(at_ms(2500));
  EXPECT_EQ(collector_.size(), 0);
}

TEST_F(PairCollectorTest, ThinsFramesAndKeepsAtMostSoMany) {
  move_arm(0, 60'000);
  set_keyframe(0, 0, 500);
  for (int ms = 1000; ms < 59'000; ms += 33) {
    collector_.add_frame(at_ms(ms), pose(1e-4 * ms));  // 3.3 mm from frame to frame
    collector_.update();
  }
  EXPECT_LE(collector_.size(), PairCollectorOptions{}.max_pairs);
  EXPECT_GT(collector_.size(), 100);
  // What is left spans the whole motion.
  const auto pairs = collector_.pairs();
  EXPECT_LT(pairs.front().time, at_ms(3000));
  EXPECT_GT(pairs.back().time, at_ms(57'000));
}

}  // namespace
}  // namespace foresight
