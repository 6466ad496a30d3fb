// Arms for tests of the simulated robot: the two WAMs, and a pendulum whose physics fit on a line.
#pragma once

#include <string>

#include "common/arm_model.h"
#include "sim/random.h"

namespace foresight::sim {

inline ArmModel load_arm(const std::string& name) {
  return load_arm_file(std::string(FORESIGHT_ARMS) + "/" + name + ".yaml");
}

/// A rod of 2 kg, 0.5 m long, that turns about z and hangs along x; no gear, no rotor.
inline ArmModel pendulum() {
  constexpr double kMass_kg = 2, kLength_m = 0.5;
  constexpr double kInertia_kg_m2 = kMass_kg * kLength_m * kLength_m / 12;
  ArmModel arm;
  arm.name = "pendulum";
  arm.joints = {{.a_m = kLength_m, .lower_rad = -3, .upper_rad = 3, .torque_limit_nm = 10}};
  arm.links = {{.mass_kg = kMass_kg,
                .centre_of_mass_m = {-kLength_m / 2, 0, 0},
                .inertia_kg_m2 = Eigen::Vector3d(0, kInertia_kg_m2, kInertia_kg_m2).asDiagonal()}};
  arm.motor_from_joint = JointMatrix::Identity(1, 1);
  arm.rotor_inertia_kg_m2 = JointVector::Zero(1);
  return arm;
}

/// `count` numbers in ±`range`.
inline JointVector random_vector(Random& random, int count, double range) {
  JointVector v(count);
  for (int i = 0; i < count; ++i) v[i] = random.uniform(-range, range);
  return v;
}

inline Eigen::Vector3d random_point(Random& random, double range) {
  return {random.uniform(-range, range), random.uniform(-range, range),
          random.uniform(-range, range)};
}

}  // namespace foresight::sim
