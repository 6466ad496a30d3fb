#include "common/arm_model.h"

#include <gtest/gtest.h>

#include <fstream>
#include <numbers>
#include <sstream>

#include "common/errors.h"
#include "tests/common/files.h"

namespace foresight {
namespace {

const std::string kArms = FORESIGHT_ARMS;

ArmModel wam4() { return load_arm_file(kArms + "/wam4.yaml"); }

JointVector joints(std::initializer_list<double> values) {
  JointVector v(static_cast<Eigen::Index>(values.size()));
  Eigen::Index i = 0;
  for (const double value : values) v[i++] = value;
  return v;
}

std::string text_of(const std::string& path) {
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

class ArmFile : public testing::Test {
 protected:
  std::string refusal(const std::string& from, const std::string& to) {
    std::string text = text_of(kArms + "/wam4.yaml");
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    const std::string path = folder_.write("arm.yaml", text);
    return error_of<ConfigError>([&] { load_arm_file(path); });
  }
  TemporaryFolder folder_;
};

TEST(ArmModel, StretchedUpTheHandIsAboveTheBase) {
  const Pose<Base, Ee> hand = wam4().base_from_ee(joints({0, 0, 0, 0}));
  EXPECT_NEAR(hand.translation().x(), 0, 1e-12);
  EXPECT_NEAR(hand.translation().y(), 0, 1e-12);
  EXPECT_NEAR(hand.translation().z(), 0.55 + 0.35, 1e-12);
}

// Joint 2 tilts the arm forward, joint 1 then turns it about the vertical.
TEST(ArmModel, JointsTurnAsInTheManual) {
  const double quarter = std::numbers::pi / 2;
  const Eigen::Vector3d forward = wam4().base_from_ee(joints({0, quarter, 0, 0})).translation();
  EXPECT_NEAR(forward.x(), 0.9, 1e-12);
  EXPECT_NEAR(forward.z(), 0, 1e-12);
  const Eigen::Vector3d left = wam4().base_from_ee(joints({quarter, quarter, 0, 0})).translation();
  EXPECT_NEAR(left.y(), 0.9, 1e-12);
  const Eigen::Vector3d bent = wam4().base_from_ee(joints({0, 0, 0, quarter})).translation();
  EXPECT_NEAR(bent.x(), 0.045 + 0.35, 1e-12);  // the elbow's offset shortens the upright part
  EXPECT_NEAR(bent.z(), 0.55 + 0.045, 1e-12);
}

TEST(ArmModel, LinksChainToTheHand) {
  const ArmModel arm = wam4();
  const JointVector q = joints({0.3, -0.4, 1.2, 2.0});
  Eigen::Isometry3d last = arm.base_from_link(q, 3);
  last.translate(Eigen::Vector3d(0, 0, arm.tool_m));
  EXPECT_TRUE(last.translation().isApprox(arm.base_from_ee(q).translation(), 1e-12));
  const auto cam = arm.base_from_cam(q);
  const Eigen::Vector3d expected = last * arm.ee_from_cam.translation();
  EXPECT_TRUE(cam.translation().isApprox(expected, 1e-12));
}

TEST(ArmModel, ClampMovesIntoTheLimitsByTheMargin) {
  const JointVector inside = wam4().clamp(joints({9, -9, 0.5, -0.89}), 0.05);
  EXPECT_TRUE(inside.isApprox(joints({2.55, -1.95, 0.5, -0.85}), 1e-12)) << inside.transpose();
}

TEST(ArmModel, EveryArmFileOfTheTreeLoadsAndStartsWithinItsLimits) {
  for (const auto& [name, count] : {std::pair{"wam4", 4}, std::pair{"wam7", 7}}) {
    const ArmModel arm = load_arm_file(kArms + "/" + name + ".yaml");
    EXPECT_EQ(arm.name, name);
    EXPECT_EQ(arm.size(), count);
    EXPECT_EQ(arm.clamp(arm.home(), 0), arm.home());
    for (const ArmLink& link : arm.links) {
      EXPECT_TRUE(link.inertia_kg_m2.isApprox(link.inertia_kg_m2.transpose()));
      EXPECT_GT(link.inertia_kg_m2.determinant(), 0);
    }
  }
}

TEST_F(ArmFile, RefusalNamesFileKeyAndLimit) {
  const std::string line = refusal("torque_limit_nm: 25", "torque_limit_nm: -25");
  for (const char* part : {"arm.yaml", "joints[0]", "torque_limit_nm", "-25", "[0, 10000]"}) {
    EXPECT_NE(line.find(part), std::string::npos) << part << " in " << line;
  }
}

TEST_F(ArmFile, RefusesWhatMakesNoArm) {
  EXPECT_NE(refusal("[-2.6, 2.6]", "[2.6, -2.6]").find("limits_rad"), std::string::npos);
  EXPECT_NE(refusal("home_rad: 2.25", "home_rad: 3.5").find("home_rad"), std::string::npos);
  EXPECT_NE(refusal("  - {mass_kg: 1.06513649", "  - {mass: 1.06513649").find("mass_kg: missing"),
            std::string::npos);
  EXPECT_NE(refusal("0, -28.25, -16.8155, 0", "0, 28.25, -16.8155, 0").find("inverted"),
            std::string::npos);
  EXPECT_NE(refusal("quat_wxyz: [0.7", "quat_wxyz: [0.1").find("length 1"), std::string::npos);
  EXPECT_NE(refusal("tool_m: 0.35", "tool_m: 0.35\nspeed: 3").find("speed: unknown"),
            std::string::npos);
}

}  // namespace
}  // namespace foresight
