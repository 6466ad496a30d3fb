// Between the robot's messages and core types. As in messages.h, what is checked here is meaning:
// unit quaternions, positive scales, joint counts that agree. A function that reads returns nothing
// on bad data.
#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "common/arm_model.h"
#include "common/frames.h"
#include "common/time.h"
#include "foresight/alignment_t.hpp"
#include "foresight/base_pose_t.hpp"
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

/// How the map lies in the robot's world (alignment_t).
struct Alignment {
  int64_t epoch = 0;
  Similarity<World, Map> world_from_map;
  Pose<Ee, Cam> ee_from_cam;
  Duration joint_delay;
};
/// Nothing unless the message says ALIGNED, and what can be.
std::optional<Alignment> read_alignment(const alignment_t& message);

/// Where the base is, and how it moves (base_pose_t).
struct BaseState {
  Time time;
  int64_t epoch = 0;
  Pose<World, Base> world_from_base;
  Eigen::Vector3d velocity_m_per_s = Eigen::Vector3d::Zero();  // in world
  Eigen::Vector3d angular_velocity_rad_per_s = Eigen::Vector3d::Zero();
  bool is_coasting = false;
};
std::optional<BaseState> read_base(const base_pose_t& message);

struct JointCommand {
  Time time;
  int64_t session = 0, seq = 0;
  bool engaged = false;
  JointVector position_rad;
};
std::optional<JointCommand> read_command(const joint_command_t& message);

struct JointState {
  Time time;
  JointVector position_rad, velocity_rad_per_s;
  JointVector reference_rad, reference_velocity_rad_per_s, target_rad;
  Time command_time, command_arrival;  // 0: none yet
};
std::optional<JointState> read_joint_state(const joint_state_t& message);

}  // namespace foresight
