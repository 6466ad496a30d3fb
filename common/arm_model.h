// An arm as its description file (deploy/arms/*.yaml) tells it: kinematics, limits, inertias,
// transmission, gains, and the camera on its hand. Plain data and forward kinematics.
//
//   const ArmModel arm = load_arm_file("deploy/arms/wam4.yaml");
//   Pose<Base, Cam> base_from_cam = arm.base_from_cam(joint_position_rad);
//
// Joints follow the standard Denavit–Hartenberg convention: link i is reached from link i−1 by a
// turn of q + theta_offset about z, a shift of d along z, a shift of a along x, a turn of alpha
// about x. The base frame is the frame of joint 1 (z is its axis). Nothing here allocates but
// load_arm_file(), so that control loops may use it.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "common/frames.h"

namespace foresight {

constexpr int kMaxJoints = 7;

/// One number per joint (or motor); never on the heap.
using JointVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxJoints, 1>;
using JointMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxJoints, kMaxJoints>;

struct ArmJoint {
  double a_m = 0, alpha_rad = 0, d_m = 0, theta_offset_rad = 0;
  double lower_rad = -3.14, upper_rad = 3.14;
  double home_rad = 0;         // of the pose to start in
  double torque_limit_nm = 0;  // of what the controller may ask of the joint
  // PID gains: N·m/rad, N·m/(rad·s), N·m·s/rad.
  double kp = 0, ki = 0, kd = 0;
};

/// Mass properties of the link that follows a joint, in that link's frame.
struct ArmLink {
  double mass_kg = 0;
  Eigen::Vector3d centre_of_mass_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d inertia_kg_m2 = Eigen::Matrix3d::Zero();  // about the centre of mass
};

struct ArmModel {
  std::string name;
  std::vector<ArmJoint> joints;  // 1…kMaxJoints
  std::vector<ArmLink> links;    // one per joint
  double tool_m = 0;             // the end effector lies this far along z of the last link
  Pose<Ee, Cam> ee_from_cam;

  /// motor angle = motor_from_joint · joint angle (rad); joint torque = its transpose · motor
  /// torque.
  JointMatrix motor_from_joint;
  JointVector rotor_inertia_kg_m2;  // of each motor
  double counts_per_revolution = 4096;

  int size() const { return static_cast<int>(joints.size()); }
  JointVector home() const;
  /// Frame of link `index` (0: after the first joint) in the base. `position_rad` has size() rows.
  Eigen::Isometry3d base_from_link(const JointVector& position_rad, int index) const;
  Pose<Base, Ee> base_from_ee(const JointVector& position_rad) const;
  Pose<Base, Cam> base_from_cam(const JointVector& position_rad) const;
  /// Moves a position into the joint limits, `margin_rad` inside of them.
  JointVector clamp(const JointVector& position_rad, double margin_rad) const;
};

/// Reads an arm description. Throws ConfigError with file, key and limit.
ArmModel load_arm_file(const std::string& path);

}  // namespace foresight
