// The equations of motion against physics that is known without them.
#include <gtest/gtest.h>

#include "sim/arm/dynamics.h"
#include "tests/sim/test_arms.h"

namespace foresight::sim {
namespace {

class Dynamics : public testing::TestWithParam<const char*> {
 protected:
  JointVector draw(double range) { return random_vector(random_, n_, range); }
  BaseMotion draw_base() {
    return {random_point(random_, 10), random_point(random_, 1), random_point(random_, 1),
            random_point(random_, 2), random_point(random_, 5)};
  }
  const ArmModel arm_ = load_arm(GetParam());
  const ArmDynamics dynamics_{arm_};
  const int n_ = arm_.size();
  const JointVector zero_ = JointVector::Zero(n_);
  Random random_{1, "dynamics"};
};

TEST_P(Dynamics, PlacesTheLinksAsTheKinematicsDo) {
  const JointVector q = draw(2);
  const PlacedArm placed = dynamics_.place(q);
  for (int i = 0; i < n_; ++i) {
    EXPECT_TRUE(placed.base_from_link[i].isApprox(arm_.base_from_link(q, i), 1e-12));
  }
}

TEST_P(Dynamics, ForwardUndoesInverse) {
  for (int trial = 0; trial < 1000; ++trial) {
    const PlacedArm placed = dynamics_.place(draw(3));
    const JointVector velocity = draw(3), acceleration = draw(20);
    const BaseMotion base = draw_base();
    const JointVector torque = dynamics_.inverse(placed, velocity, acceleration, base);
    const JointVector back = dynamics_.forward(placed, velocity, torque, base);
    ASSERT_LT((back - acceleration).norm(), 1e-8 * acceleration.norm());
  }
}

TEST_P(Dynamics, MassMatrixIsWhatUnitAccelerationsNeed) {
  for (int trial = 0; trial < 100; ++trial) {
    const PlacedArm placed = dynamics_.place(draw(3));
    const JointMatrix mass = dynamics_.mass_matrix(placed);
    BaseMotion still;
    still.gravity_m_per_s2.setZero();
    for (int i = 0; i < n_; ++i) {
      const JointVector unit = JointVector::Unit(n_, i);
      const JointVector column = dynamics_.inverse(placed, zero_, unit, still);
      ASSERT_LT((column - mass.col(i)).norm(), 1e-12 * mass.norm());
    }
    ASSERT_EQ(mass.llt().info(), Eigen::Success) << "not positive definite";
  }
}

TEST_P(Dynamics, GravityTorqueIsTheSlopeOfPotentialEnergy) {
  for (int trial = 0; trial < 100; ++trial) {
    const JointVector q = draw(3);
    BaseMotion tilted;
    tilted.gravity_m_per_s2 = random_point(random_, 10);
    const JointVector torque = dynamics_.inverse(dynamics_.place(q), zero_, zero_, tilted);
    for (int i = 0; i < n_; ++i) {
      constexpr double kStep = 1e-5;
      const JointVector step = kStep * JointVector::Unit(n_, i);
      const auto energy = [&](const JointVector& at) {
        return dynamics_.potential_energy_j(dynamics_.place(at), tilted.gravity_m_per_s2);
      };
      ASSERT_NEAR(torque[i], (energy(q + step) - energy(q - step)) / (2 * kStep), 1e-6);
    }
  }
}

// The rotor of the first joint stands on the base, so its inertia feels the joint alone.
TEST_P(Dynamics, ABaseThatTurnsAboutTheFirstAxisFeelsLikeTheFirstJoint) {
  ArmModel arm = arm_;
  arm.rotor_inertia_kg_m2.setZero();
  const ArmDynamics dynamics(arm);
  const PlacedArm placed = dynamics.place(draw(3));
  JointVector velocity = draw(2), acceleration = draw(5);
  const JointVector by_joint = dynamics.inverse(placed, velocity, acceleration, {});
  BaseMotion base;
  base.angular_velocity_rad_per_s.z() = velocity[0];
  base.angular_acceleration_rad_per_s2.z() = acceleration[0];
  velocity[0] = acceleration[0] = 0;
  const JointVector by_base = dynamics.inverse(placed, velocity, acceleration, base);
  EXPECT_LT((by_joint - by_base).norm(), 1e-10);
}

TEST_P(Dynamics, ABaseThatFallsFreelyLeavesTheArmWeightless) {
  const PlacedArm placed = dynamics_.place(draw(3));
  BaseMotion falling;
  falling.acceleration_m_per_s2 = falling.gravity_m_per_s2;
  falling.velocity_m_per_s = random_point(random_, 3);
  EXPECT_LT(dynamics_.inverse(placed, zero_, zero_, falling).norm(), 1e-12);
}

TEST_P(Dynamics, PointVelocityIsTheDerivativeOfItsPlace) {
  const JointVector q = draw(2), velocity = draw(1);
  const Eigen::Vector3d point_in_link = random_point(random_, 0.3);
  constexpr double kStep_s = 1e-6;
  for (int link = 0; link < n_; ++link) {
    const auto place = [&](double time_s) -> Eigen::Vector3d {
      return arm_.base_from_link(q + time_s * velocity, link) * point_in_link;
    };
    const Eigen::Vector3d expected = (place(kStep_s) - place(-kStep_s)) / (2 * kStep_s);
    const Eigen::Vector3d found =
        dynamics_.point_velocity(dynamics_.place(q), velocity, link, place(0));
    EXPECT_LT((found - expected).norm(), 1e-7);
  }
}

INSTANTIATE_TEST_SUITE_P(Arms, Dynamics, testing::Values("wam4", "wam7"),
                         [](const auto& arm) { return std::string(arm.param); });

TEST(RotorInertia, CountsWithTheSquareOfTheGear) {
  ArmModel arm = pendulum();
  arm.motor_from_joint(0, 0) = 20;
  arm.rotor_inertia_kg_m2[0] = 1e-3;
  const ArmDynamics with(arm), without(pendulum());
  const JointVector q = JointVector::Zero(1);
  EXPECT_NEAR(with.mass_matrix(with.place(q))(0, 0),
              without.mass_matrix(without.place(q))(0, 0) + 0.4, 1e-12);
}

}  // namespace
}  // namespace foresight::sim
