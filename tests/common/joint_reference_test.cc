#include "common/joint_reference.h"

#include <gtest/gtest.h>

#include <random>

namespace foresight {
namespace {

JointVector joints(std::initializer_list<double> values) {
  JointVector v(static_cast<Eigen::Index>(values.size()));
  Eigen::Index i = 0;
  for (const double value : values) v[i++] = value;
  return v;
}

Time at_ms(int64_t ms) { return Time{0} + milliseconds(ms); }

TEST(JointReference, MovesEachJointOnItsOwnTrapezoid) {
  JointReference reference({1, 1});
  reference.rest(at_ms(0), joints({0, 1}));
  EXPECT_TRUE(reference.is_at_rest(at_ms(0)));
  reference.follow(at_ms(100), joints({0.25, -2}));
  EXPECT_FALSE(reference.is_at_rest(at_ms(100)));
  EXPECT_NEAR(reference.at(at_ms(1100)).position_rad[0], 0.25, 1e-12);
  EXPECT_NEAR(reference.at(at_ms(1100)).velocity_rad_per_s[1], -1, 1e-12);
  EXPECT_EQ(reference.target_rad(), joints({0.25, -2}));
  EXPECT_FALSE(reference.is_at_rest(at_ms(4099)));
  EXPECT_TRUE(reference.is_at_rest(at_ms(4101)));
}

TEST(JointReference, BeginsInMotionAndStopsUntilItIsTold) {
  JointReference reference({1, 1});
  reference.begin(at_ms(0), joints({0}), joints({0.6}));
  EXPECT_NEAR(reference.at(at_ms(100)).velocity_rad_per_s[0], 0.5, 1e-12);
  reference.follow(at_ms(100), joints({3}));
  EXPECT_NEAR(reference.at(at_ms(200)).velocity_rad_per_s[0], 0.6, 1e-12);
}

TEST(JointReference, StopRampsDownWithinTheLimit) {
  JointReference reference({1, 2});
  reference.rest(at_ms(0), joints({0}));
  reference.follow(at_ms(0), joints({3}));
  reference.stop(at_ms(1000));
  EXPECT_NEAR(reference.at(at_ms(1000)).velocity_rad_per_s[0], 1, 1e-12);
  EXPECT_NEAR(reference.at(at_ms(1250)).velocity_rad_per_s[0], 0.5, 1e-12);
  EXPECT_TRUE(reference.is_at_rest(at_ms(1501)));
}

// Stamps of another process may lie a little before the last command: the reference waits.
TEST(JointReference, StandsStillBeforeItsLastFit) {
  JointReference reference({1, 1});
  reference.rest(at_ms(0), joints({0}));
  reference.follow(at_ms(100), joints({1}));
  EXPECT_EQ(reference.at(at_ms(99)).position_rad, reference.at(at_ms(100)).position_rad);
}

// What prediction rests on: one that goes on from the published state ends where the other does.
TEST(JointReference, CanBeContinuedElsewhereFromItsState) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> anywhere(-2, 2);
  JointReference here({1, 1});
  here.rest(at_ms(0), joints({0, 0, 0}));
  for (int64_t ms = 0; ms < 30'000; ms += 33) {
    const JointMotion now = here.at(at_ms(ms));
    JointReference there({1, 1});
    there.begin(at_ms(ms), now.position_rad, now.velocity_rad_per_s);
    const JointVector target = joints({anywhere(random), anywhere(random), anywhere(random)});
    here.follow(at_ms(ms + 5), target);
    // The copy has not heard of the old target, so it hears of the new one at once.
    JointReference heard = there;
    heard.follow(at_ms(ms), target);
    EXPECT_TRUE(heard.at(at_ms(ms + 9'000)).position_rad.isApprox(target, 1e-9));
    EXPECT_TRUE(here.at(at_ms(ms + 9'000)).position_rad.isApprox(target, 1e-9));
    EXPECT_TRUE(there.is_at_rest(at_ms(ms + 1001)));
  }
}

TEST(JointReference, IsAFunctionOfCommandsAndTimesAlone) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> anywhere(-2, 2);
  JointReference often({1, 1}), seldom({1, 1});
  often.rest(at_ms(0), joints({0.3}));
  seldom.rest(at_ms(0), joints({0.3}));
  for (int64_t ms = 0; ms < 10'000; ++ms) {
    if (ms % 33 == 0) {
      const JointVector target = joints({anywhere(random)});
      often.follow(at_ms(ms), target);
      seldom.follow(at_ms(ms), target);
    }
    [[maybe_unused]] const JointMotion asked = often.at(at_ms(ms));
  }
  EXPECT_EQ(often.at(at_ms(10'000)).position_rad, seldom.at(at_ms(10'000)).position_rad);
}

}  // namespace
}  // namespace foresight
