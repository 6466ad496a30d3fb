#include "procs/wam_controller/arm_dynamics.h"

#include <gtest/gtest.h>

#include <random>

#include "procs/wam_controller/transmission.h"
#include "tests/wam_controller/joints.h"
#include "tests/wam_controller/plant.h"

namespace foresight {
namespace {

const Eigen::Vector3d kDown(0, 0, -9.81);

class ArmDynamicsTest : public testing::TestWithParam<const char*> {
 protected:
  JointVector random_joints(double range) {
    std::uniform_real_distribution<double> any(-range, range);
    JointVector v(arm_.size());
    for (double& x : v) x = any(random_);
    return v;
  }
  std::mt19937 random_{5};
  const ArmModel arm_ = load_arm_file(kArms + "/" + GetParam() + ".yaml");
  const Plant plant_{arm_};
  const JointVector zero_ = JointVector::Zero(arm_.size());
};

TEST_P(ArmDynamicsTest, GravityIsTheSlopeOfThePotentialEnergy) {
  for (int n = 0; n < 200; ++n) {
    const Eigen::Vector3d gravity = n % 2 == 0 ? kDown : Eigen::Vector3d(3, -4, -8);
    const JointVector q = random_joints(3);
    const JointVector torque = ArmDynamics(arm_, gravity).torque_nm(q, zero_, zero_);
    for (int i = 0; i < arm_.size(); ++i) {
      JointVector up = q, down = q;
      up[i] += 1e-6;
      down[i] -= 1e-6;
      const double slope =
          (plant_.potential_energy_j(up, gravity) - plant_.potential_energy_j(down, gravity)) /
          2e-6;
      ASSERT_NEAR(torque[i], slope, 1e-6);
    }
  }
}

TEST_P(ArmDynamicsTest, InertiaIsTheMassMatrixOfTheKineticEnergy) {
  const ArmDynamics weightless(arm_, Eigen::Vector3d::Zero());
  for (int n = 0; n < 200; ++n) {
    const JointVector q = random_joints(3), a = random_joints(2);
    const JointVector expected = plant_.mass_matrix(q) * a;
    ASSERT_TRUE(weightless.torque_nm(q, zero_, a).isApprox(expected, 1e-10)) << n;
  }
}

TEST_P(ArmDynamicsTest, MotionAddsItsCoriolisTorques) {
  const ArmDynamics dynamics(arm_, kDown);
  for (int n = 0; n < 100; ++n) {
    const JointVector q = random_joints(3), v = random_joints(2), a = random_joints(2);
    const JointVector expected =
        plant_.mass_matrix(q) * a + plant_.coriolis_nm(q, v) + plant_.gravity_nm(q, kDown);
    ASSERT_LT((dynamics.torque_nm(q, v, a) - expected).cwiseAbs().maxCoeff(), 1e-6) << n;
  }
}

INSTANTIATE_TEST_SUITE_P(Arms, ArmDynamicsTest, testing::Values("wam4", "wam7"));

TEST(ArmDynamics, AnUprightArmNeedsNoTorqueAndAStretchedOneItsWeightTimesLever) {
  const ArmModel arm = load_arm_file(kArms + "/wam4.yaml");
  const ArmDynamics dynamics(arm, kDown);
  const JointVector zero = JointVector::Zero(4);
  const JointVector forward = dynamics.torque_nm(joints({0, 1.5707963, 0, 0}), zero, zero);
  EXPECT_NEAR(forward[0], 0, 1e-6);  // the first axis is vertical
  EXPECT_LT(forward[1], -8);         // holds the stretched arm up
  EXPECT_GT(forward[1], -arm.joints[1].torque_limit_nm);
}

TEST(TransmissionTest, CountsBecomeJointAnglesAndBack) {
  const ArmModel arm = load_arm_file(kArms + "/wam7.yaml");
  const Transmission transmission(arm);
  const JointVector q = joints({0.3, -0.5, 1.1, 2.0, -1.0, 0.7, 2.5});
  const JointVector counts = transmission.motor_counts(q);
  std::array<int32_t, 7> rounded{};
  for (size_t i = 0; i < 7; ++i) {
    rounded[i] = static_cast<int32_t>(std::lround(counts[static_cast<Eigen::Index>(i)]));
  }
  EXPECT_LT((transmission.joint_position_rad(rounded) - q).cwiseAbs().maxCoeff(), 2e-4);
}

// The same work at the motors as at the joints.
TEST(TransmissionTest, TorquesKeepThePower) {
  const ArmModel arm = load_arm_file(kArms + "/wam4.yaml");
  const Transmission transmission(arm);
  const JointVector torque = joints({5, -12, 3, 7}), velocity = joints({0.1, 0.7, -0.3, 0.9});
  const JointVector motor_velocity = arm.motor_from_joint * velocity;
  EXPECT_NEAR(transmission.motor_torque_nm(torque).dot(motor_velocity), torque.dot(velocity),
              1e-12);
  EXPECT_NEAR(transmission.motor_torque_nm(torque)[0], 5.0 / -42, 1e-12);
}

}  // namespace
}  // namespace foresight
