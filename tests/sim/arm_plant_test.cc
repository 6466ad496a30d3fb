// The arm in motion: energy, periods, friction, stops, limits, encoders.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "sim/arm/plant.h"
#include "tests/sim/test_arms.h"

namespace foresight::sim {
namespace {

constexpr Duration kTick = milliseconds(2);

PlantParams without_friction() {
  PlantParams params;
  params.coulomb_share = params.viscous_share_s = 0;
  return params;
}

BaseMotion gravity_along_x() {
  BaseMotion base;
  base.gravity_m_per_s2 = {kGravity_m_per_s2, 0, 0};
  return base;
}

double energy_j(const ArmPlant& plant, const BaseMotion& base) {
  const PlacedArm placed = plant.dynamics().place(plant.state().position_rad);
  return plant.dynamics().kinetic_energy_j(placed, plant.state().velocity_rad_per_s) +
         plant.dynamics().potential_energy_j(placed, base.gravity_m_per_s2);
}

// Without joint stops in its way.
ArmModel free_arm(const char* name) {
  ArmModel arm = load_arm(name);
  for (ArmJoint& joint : arm.joints) {
    joint.lower_rad = -1e3;
    joint.upper_rad = 1e3;
  }
  return arm;
}

class Energy : public testing::TestWithParam<const char*> {};

struct Swing {
  double kinetic_j = 0, error_j = 0;  // the most of each
};

// Lets the arm fall and swing for 3 s.
Swing swing(const ArmModel& arm, Duration tick) {
  ArmPlant plant(arm, without_friction());
  const JointVector no_torque = JointVector::Zero(arm.size());
  const double before_j = energy_j(plant, {});
  Swing result;
  for (Duration t; t < seconds(3); t = t + tick) {
    plant.step(tick, no_torque, MotorMode::kDriven, {});
    const PlacedArm placed = plant.dynamics().place(plant.state().position_rad);
    const double kinetic_j =
        plant.dynamics().kinetic_energy_j(placed, plant.state().velocity_rad_per_s);
    result.kinetic_j = std::max(result.kinetic_j, kinetic_j);
    result.error_j = std::max(result.error_j, std::abs(energy_j(plant, {}) - before_j));
  }
  return result;
}

// In substeps of 0.5 ms with the wrist whirling freely, and better in finer ones.
TEST_P(Energy, StaysWithoutFrictionAndTorque) {
  const ArmModel arm = free_arm(GetParam());
  const Swing coarse = swing(arm, kTick), fine = swing(arm, microseconds(50));
  EXPECT_GT(coarse.kinetic_j, 5);
  EXPECT_LT(coarse.error_j, 0.02 * coarse.kinetic_j);
  EXPECT_LT(fine.error_j, 0.2 * coarse.error_j);
}

TEST_P(Energy, FrictionAndBrakingOnlyTakeIt) {
  const ArmModel arm = free_arm(GetParam());
  for (const MotorMode mode : {MotorMode::kDriven, MotorMode::kBraking}) {
    ArmPlant plant(arm, {});
    const JointVector no_torque = JointVector::Zero(arm.size());
    double last_j = energy_j(plant, {});
    for (int tick = 0; tick < 1500; ++tick) {
      plant.step(kTick, no_torque, mode, {});
      const double now_j = energy_j(plant, {});
      ASSERT_LT(now_j, last_j + 2e-3) << "tick " << tick;
      last_j = now_j;
    }
  }
}

TEST_P(Energy, TwoRunsAgreeBitByBit) {
  const ArmModel arm = load_arm(GetParam());
  const auto run = [&] {
    ArmPlant plant(arm, {});
    Random random(3, "torques");
    for (int tick = 0; tick < 500; ++tick) {
      plant.step(kTick, random_vector(random, arm.size(), 0.3), MotorMode::kDriven, {});
    }
    return plant.state();
  };
  const ArmState first = run(), second = run();
  EXPECT_EQ(first.position_rad, second.position_rad);
  EXPECT_EQ(first.velocity_rad_per_s, second.velocity_rad_per_s);
}

INSTANTIATE_TEST_SUITE_P(Arms, Energy, testing::Values("wam4", "wam7"),
                         [](const auto& arm) { return std::string(arm.param); });

TEST(Pendulum, SwingsWithItsPeriod) {
  ArmPlant plant(pendulum(), without_friction());
  plant.set_state({JointVector::Constant(1, 0.05), JointVector::Zero(1)});
  const JointVector no_torque = JointVector::Zero(1);
  double last_rad = 0.05, first_crossing_s = 0, period_s = 0;
  for (int tick = 1; period_s == 0 && tick < 10'000; ++tick) {
    plant.step(kTick, no_torque, MotorMode::kDriven, gravity_along_x());
    const double now_rad = plant.state().position_rad[0];
    if (last_rad < 0 && now_rad >= 0) {
      const double time_s = kTick.seconds() * (tick - now_rad / (now_rad - last_rad));
      (first_crossing_s == 0 ? first_crossing_s : period_s) = time_s - first_crossing_s;
    }
    last_rad = now_rad;
  }
  // A rod about its end: T = 2π √(2 l / 3 g), and a little longer at 0.05 rad.
  const double small_s = 2 * std::numbers::pi * std::sqrt(2 * 0.5 / (3 * kGravity_m_per_s2));
  EXPECT_NEAR(period_s, small_s * (1 + 0.05 * 0.05 / 16), 1e-4 * small_s);
}

TEST(Friction, HoldsAgainstLittleAndSlowsEvenly) {
  ArmModel arm = pendulum();
  BaseMotion weightless;
  weightless.gravity_m_per_s2.setZero();
  ArmPlant plant(arm, {.viscous_share_s = 0});
  const double inertia = plant.dynamics().mass_matrix(plant.dynamics().place(arm.home()))(0, 0);
  plant.set_state({JointVector::Zero(1), JointVector::Constant(1, 1.0)});
  plant.step(milliseconds(100), JointVector::Zero(1), MotorMode::kDriven, weightless);
  const double coulomb_nm = 0.04 * arm.joints[0].torque_limit_nm;
  EXPECT_NEAR(plant.state().velocity_rad_per_s[0], 1 - 0.1 * coulomb_nm / inertia, 1e-3);
  for (int i = 0; i < 1000; ++i) {  // half of what friction can hold: it only creeps
    plant.step(kTick, JointVector::Constant(1, coulomb_nm / 2), MotorMode::kDriven, weightless);
  }
  EXPECT_LT(std::abs(plant.state().velocity_rad_per_s[0]), 0.02);
}

TEST(Friction, LeavesLightWristJointsStable) {
  const ArmModel arm = load_arm("wam7");
  ArmPlant plant(arm, {});
  JointVector velocity = JointVector::Zero(7);
  velocity[6] = 0.3;
  plant.set_state({arm.home(), velocity});
  for (int i = 0; i < 50; ++i) {
    plant.step(kTick, JointVector::Zero(7), MotorMode::kBraking, {});
    ASSERT_LT(std::abs(plant.state().velocity_rad_per_s[6]), 0.3001);
  }
  EXPECT_LT(std::abs(plant.state().velocity_rad_per_s[6]), 0.05);
}

TEST(JointStop, CatchesAndReleases) {
  ArmModel arm = pendulum();
  arm.joints[0].upper_rad = 0.5;
  ArmPlant plant(arm, without_friction());
  BaseMotion weightless;
  weightless.gravity_m_per_s2.setZero();
  plant.set_state({JointVector::Constant(1, 0.4), JointVector::Constant(1, 3.0)});
  double deepest_rad = 0, fastest = 0;
  for (int i = 0; i < 500; ++i) {
    plant.step(kTick, JointVector::Constant(1, 5.0), MotorMode::kDriven, weightless);
    deepest_rad = std::max(deepest_rad, plant.state().position_rad[0] - 0.5);
    fastest = std::max(fastest, -plant.state().velocity_rad_per_s[0]);
  }
  EXPECT_LT(deepest_rad, 0.03);
  EXPECT_LT(fastest, 1) << "it throws back";
  EXPECT_NEAR(plant.state().position_rad[0], 0.5, 0.005);  // pushed against it with 5 N·m
  plant.set_state({plant.state().position_rad, JointVector::Constant(1, -1.0)});
  plant.step(milliseconds(100), JointVector::Zero(1), MotorMode::kDriven, weightless);
  EXPECT_LT(plant.state().position_rad[0], 0.42) << "it sticks";
}

TEST(Motors, GiveNoMoreThanTheyCan) {
  const ArmModel arm = load_arm("wam4");
  ArmPlant limited(arm, {}), excessive(arm, {});
  for (int i = 0; i < 100; ++i) {
    limited.step(kTick, limited.motor_limit_nm(), MotorMode::kDriven, {});
    excessive.step(kTick, 100 * limited.motor_limit_nm(), MotorMode::kDriven, {});
  }
  EXPECT_EQ(limited.state().position_rad, excessive.state().position_rad);
  EXPECT_GT((limited.state().position_rad - arm.home()).norm(), 0.01);
}

TEST(Motors, AreStrongEnoughForEveryJointAtItsLimit) {
  const ArmModel arm = load_arm("wam7");
  const ArmPlant plant(arm, {});
  Random random(1, "limits");
  for (int trial = 0; trial < 1000; ++trial) {
    JointVector joint_nm(7);
    for (int i = 0; i < 7; ++i) {
      joint_nm[i] = random.uniform(-1, 1) * arm.joints[static_cast<size_t>(i)].torque_limit_nm;
    }
    const JointVector motor_nm = arm.motor_from_joint.transpose().lu().solve(joint_nm);
    ASSERT_TRUE((motor_nm.cwiseAbs().array() <= plant.motor_limit_nm().array()).all());
  }
}

TEST(Braking, LetsTheArmSinkSlowly) {
  const ArmModel arm = load_arm("wam4");
  ArmPlant plant(arm, {});
  JointVector stretched = arm.home();
  stretched[1] = 0.8;
  plant.set_state({stretched, JointVector::Zero(4)});
  for (int i = 0; i < 500; ++i) {
    plant.step(kTick, JointVector::Zero(4), MotorMode::kBraking, {});
    ASSERT_LT(plant.state().velocity_rad_per_s.cwiseAbs().maxCoeff(), 0.5);
  }
  EXPECT_GT(plant.state().position_rad[1], 0.9);
}

TEST(Stand, HoldsTheArm) {
  const ArmModel arm = load_arm("wam4");
  ArmPlant plant(arm, {});
  plant.step(seconds(1), JointVector::Constant(4, 0.5), MotorMode::kHeld, {});
  EXPECT_EQ(plant.state().position_rad, arm.home());
}

TEST(Encoders, CountTheMotorsTurns) {
  const ArmModel arm = load_arm("wam4");
  ArmPlant plant(arm, {});
  JointVector q = JointVector::Zero(4);
  q[0] = 0.1;
  q[2] = 0.2;
  plant.set_state({q, JointVector::Zero(4)});
  std::vector<int32_t> counts(4);
  plant.read_encoders(counts);
  const double counts_per_rad = 4096 / (2 * std::numbers::pi);
  EXPECT_EQ(counts[0], std::lround(-42 * 0.1 * counts_per_rad));
  EXPECT_EQ(counts[1], std::lround(-16.8155 * 0.2 * counts_per_rad));
  EXPECT_EQ(counts[2], counts[1]);
  EXPECT_EQ(counts[3], 0);
}

}  // namespace
}  // namespace foresight::sim
