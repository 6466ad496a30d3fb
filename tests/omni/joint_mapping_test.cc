// The paper's mapping on what the Omni really reads (joints about ±0.98, 0…1.75,
// −0.81…1.25 rad).
#include "procs/omni/joint_mapping.h"

#include <gtest/gtest.h>

#include <numbers>

#include "procs/omni/omni_model.h"
#include "tests/omni/arms.h"

namespace foresight {
namespace {

constexpr double kQuarterTurn_rad = std::numbers::pi / 2;

JointVector mapped(const JointMapping& mapping, std::vector<double> axes_rad) {
  return map_positions(mapping, wam4(), axes_rad);
}

TEST(JointMapping, IsThePapersFormulaInThePapersSenseOfTheAxes) {
  JointMapping mapping = paper_mapping();
  mapping.axis_signs = {};
  const JointVector arm_rad = mapped(mapping, {0.3, -0.5, 0.7});
  EXPECT_DOUBLE_EQ(arm_rad[0], 0.3);
  EXPECT_DOUBLE_EQ(arm_rad[1], 9.0 / 5.0 * 0.5 - kQuarterTurn_rad);
  EXPECT_DOUBLE_EQ(arm_rad[2], 0);
  EXPECT_DOUBLE_EQ(arm_rad[3], kQuarterTurn_rad - 0.7);
}

TEST(JointMapping, KeepsTheSecondJointInsideItsLimitsForWhatTheOmniReads) {
  const AxisRange range = kOmniRanges[1];
  EXPECT_NEAR(mapped(paper_mapping(), {0, range.lower_rad, 0})[1], -1.57, 0.005);
  EXPECT_NEAR(mapped(paper_mapping(), {0, range.upper_rad, 0})[1], 1.58, 0.005);
}

TEST(JointMapping, WithTheLibrarysOwnSignWouldLeaveTheLimits) {
  JointMapping mapping = paper_mapping();
  mapping.axis_signs = {1, 1, 1};
  EXPECT_NEAR(mapped(mapping, {0, kOmniRanges[1].upper_rad, 0})[1], -4.72, 0.005);
}

TEST(JointMapping, ReachesTheArmsHomeFromWithinTheOmnisRange) {
  const JointVector home = wam4().home();
  const std::vector<double> axes{0, (home[1] + kQuarterTurn_rad) / 1.8, kQuarterTurn_rad - home[3]};
  for (size_t i = 0; i < axes.size(); ++i) {
    EXPECT_GT(axes[i], kOmniRanges[i].lower_rad);
    EXPECT_LT(axes[i], kOmniRanges[i].upper_rad);
  }
  EXPECT_LT((mapped(paper_mapping(), axes) - home).norm(), 1e-12);
}

TEST(JointMapping, MovesOneJointPerAxisWithTheRightSignAndScale) {
  const std::vector<double> at{0.1, 0.6, -0.2};
  const double expected[3] = {1, 1.8, -1};  // rad of joints 1, 2, 4 per rad of axes 1, 2, 3
  const int joint_of[3] = {0, 1, 3};
  for (size_t axis = 0; axis < 3; ++axis) {
    std::vector<double> moved = at;
    moved[axis] += 0.01;
    const JointVector change = mapped(paper_mapping(), moved) - mapped(paper_mapping(), at);
    for (int joint = 0; joint < 4; ++joint) {
      const double slope = joint == joint_of[axis] ? expected[axis] : 0;
      EXPECT_NEAR(change[joint], 0.01 * slope, 1e-12) << axis << " " << joint;
    }
  }
}

TEST(JointMapping, HoldsJointsAtAnOffsetOrAtHome) {
  const JointMapping mapping{.axis_signs = {}, .joints = {{}, {.offset_rad = 0.4}, {.axis = 2}}};
  const JointVector arm_rad = mapped(mapping, {9, 0.2});
  EXPECT_EQ(arm_rad[0], wam4().home()[0]);
  EXPECT_EQ(arm_rad[1], 0.4);
  EXPECT_EQ(arm_rad[2], 0.2);
  EXPECT_EQ(arm_rad[3], wam4().home()[3]) << "beyond the list";
  EXPECT_EQ(mapping.axes_needed(), 2);
}

TEST(JointMapping, LeavesTheWristOfSevenJointsAtHome) {
  const ArmModel arm = wam7();
  const JointVector arm_rad = map_positions(paper_mapping(), arm, std::vector<double>{0, 1, 0});
  ASSERT_EQ(arm_rad.size(), 7);
  EXPECT_EQ(arm_rad.tail(3), arm.home().tail(3));
}

TEST(JointMapping, TurnsDeflectionsIntoSharesOfTheVelocity) {
  const ArmModel arm = wam4();
  const std::vector<double> sticks{0.5, -1, 0.9, 0.9, 0.25, 0, 0, 0};
  const JointVector velocity = map_deflections(gamepad_mapping(), arm, sticks);
  EXPECT_EQ(velocity, (JointVector(4) << -0.5, 1, 0, 0.25).finished());
  const std::vector<double> keys{1, -1, 1, 0, 0, 0, 0};
  EXPECT_EQ(map_deflections(keyboard_mapping(), arm, keys),
            (JointVector(4) << 1, -1, 0, -1).finished());
}

}  // namespace
}  // namespace foresight
