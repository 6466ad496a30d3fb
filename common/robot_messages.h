// Between the robot's messages and core types (common/robot_types.h), both ways, field by field. As
// in messages.h, what is checked here is meaning: unit quaternions, positive scales, joint counts
// that agree. A function that reads returns nothing on bad data.
#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "common/arm_model.h"
#include "common/frames.h"
#include "common/robot_types.h"
#include "foresight/alignment_t.hpp"
#include "foresight/base_pose_t.hpp"
#include "foresight/controller_state_t.hpp"
#include "foresight/joint_command_t.hpp"
#include "foresight/joint_state_t.hpp"
#include "foresight/truth_t.hpp"

namespace foresight {

/// A rotation and a position as messages carry them; nothing unless the quaternion is a unit one.
template <class A, class B>
std::optional<Pose<A, B>> read_transform(const double quat_wxyz[4], const double position[3]) {
  const Eigen::Quaterniond q(quat_wxyz[0], quat_wxyz[1], quat_wxyz[2], quat_wxyz[3]);
  if (!(std::abs(q.norm() - 1.0) < 1e-3)) return std::nullopt;
  return Pose<A, B>(q, Eigen::Vector3d(position[0], position[1], position[2]));
}

template <class A, class B>
void write_transform(const Pose<A, B>& a_from_b, double quat_wxyz[4], double position[3]) {
  const Eigen::Quaterniond& q = a_from_b.rotation();
  quat_wxyz[0] = q.w();
  quat_wxyz[1] = q.x();
  quat_wxyz[2] = q.y();
  quat_wxyz[3] = q.z();
  for (int i = 0; i < 3; ++i) position[i] = a_from_b.translation()[i];
}

/// Joint numbers of a message; nothing unless there are 1…kMaxJoints.
std::optional<JointVector> read_joints(const std::vector<double>& values);
std::vector<double> write_joints(const JointVector& values);

/// Nothing unless the message says ALIGNED, and what can be.
std::optional<Alignment> read_alignment(const alignment_t& message);
/// What `alignment` knows; state, reason and doubt are the sender's.
void write_alignment(const Alignment& alignment, alignment_t* message);

std::optional<BaseState> read_base(const base_pose_t& message);
base_pose_t write_base(const BaseState& base);

/// Of every message: letting go needs no joints. Without joints, or with more than kMaxJoints of
/// them, position_rad is empty.
JointCommand read_command(const joint_command_t& message);
joint_command_t write_command(const JointCommand& command);

std::optional<JointState> read_joint_state(const joint_state_t& message);
joint_state_t write_joint_state(const JointState& state);

ControllerState read_controller_state(const controller_state_t& message);
/// What `state` knows; the other counters are the sender's.
void write_controller_state(const ControllerState& state, controller_state_t* message);

}  // namespace foresight
