#include "procs/omni/motion.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/errors.h"
#include "tests/common/files.h"

namespace foresight {
namespace {

std::string refusal(const std::string& text) {
  return error_of<ConfigError>([&] { parse_motion_table(text, "hand.csv"); });
}

TEST(Motion, ReadsTables) {
  const auto samples = parse_motion_table(
      "# a hand\n\ntime_s,engaged,j1_rad,j2_rad\n0,1,0.5,-1e-1\r\n0.5 0\t1  2", "hand.csv");
  ASSERT_EQ(samples.size(), 2u);
  EXPECT_TRUE(samples[0].engaged);
  EXPECT_EQ(samples[0].position_rad, (std::vector{0.5, -0.1}));
  EXPECT_FALSE(samples[1].engaged);
  EXPECT_EQ(samples[1].time_s, 0.5);
  EXPECT_EQ(samples[1].position_rad, (std::vector<double>{1, 2}));
  EXPECT_TRUE(parse_motion_table("time_s j1\n0 1\n", "hand.csv")[0].engaged);
}

TEST(Motion, RefusesTablesWithOneLineThatSaysWhere) {
  EXPECT_NE(refusal("").find("hand.csv: has no samples"), std::string::npos);
  EXPECT_NE(refusal("time_s,j1\n").find("no samples"), std::string::npos);
  EXPECT_NE(refusal("0,1\n").find("hand.csv:1: must name the columns"), std::string::npos);
  EXPECT_NE(refusal("time_s,engaged\n0,1\n").find("name the columns"), std::string::npos);
  EXPECT_NE(refusal("time_s,j1\n0,1,2\n").find("hand.csv:2: has 3 columns, not 2"),
            std::string::npos);
  EXPECT_NE(refusal("time_s,j1\n0,x\n").find("'x' is not a number"), std::string::npos);
  EXPECT_NE(refusal("time_s,j1\n0,nan\n").find("not a number"), std::string::npos);
  EXPECT_NE(refusal("time_s,j1\n0,1\n0,1\n").find("hand.csv:3: time_s must increase"),
            std::string::npos);
  EXPECT_NE(refusal("time_s,j1\n0,1e3\n").find("20 rad"), std::string::npos);
}

TEST(Motion, IsStraightBetweenDenseSamples) {
  const Motion motion({{1, true, {0, 2}}, {3, false, {1, 0}}}, MotionStyle::kLinear);
  EXPECT_EQ(motion.at(0).position_rad, (std::vector<double>{0, 2}));
  EXPECT_EQ(motion.at(1.5).position_rad, (std::vector{0.25, 1.5}));
  EXPECT_TRUE(motion.at(2.9).engaged);
  EXPECT_FALSE(motion.at(3).engaged);
  EXPECT_EQ(motion.at(99).position_rad, (std::vector<double>{1, 0}));
  EXPECT_EQ(motion.duration_s(), 2);
}

TEST(Motion, RestsAtWaypoints) {
  const Motion motion({{0, true, {0}}, {2, true, {1}}, {4, true, {-1}}}, MotionStyle::kRest);
  constexpr double kStep_s = 1e-4;
  double peak = 0;
  for (double t = 0; t < 4; t += kStep_s) {
    const double velocity =
        (motion.at(t + kStep_s).position_rad[0] - motion.at(t).position_rad[0]) / kStep_s;
    peak = std::max(peak, std::abs(velocity));
    const double from_knot_s = std::abs(t - 2 * std::round(t / 2));
    if (from_knot_s < 0.01) {
      EXPECT_LT(std::abs(velocity), 0.01) << t;
    }
  }
  EXPECT_NEAR(peak, kRestPeakVelocity * 2 / 2, 1e-3);
  EXPECT_EQ(motion.at(2).position_rad[0], 1);
}

}  // namespace
}  // namespace foresight
