// Each field of a message reaches the field of its meaning, and comes back from it: the numbers all
// differ, so that two that are swapped, or one that is left out, show.
#include "common/robot_messages.h"

#include <gtest/gtest.h>

#include "common/node.h"

namespace foresight {
namespace {

void set_transform(double quat_wxyz[4], double position_m[3], double x) {
  for (int i = 0; i < 4; ++i) quat_wxyz[i] = i == 2 ? -0.5 : 0.5;
  for (int i = 0; i < 3; ++i) position_m[i] = x + i;
}

TEST(RobotMessages, JointStateComesBack) {
  joint_state_t m{};
  m.utime = 7;
  m.n_joints = 2;
  m.position_rad = {1, 2};
  m.velocity_rad_per_s = {3, 4};
  m.reference_position_rad = {5, 6};
  m.reference_velocity_rad_per_s = {7, 8};
  m.target_position_rad = {9, 10};
  m.command_utime = 5;
  m.command_arrival_utime = 6;
  const auto s = read_joint_state(m);
  ASSERT_TRUE(s);
  EXPECT_EQ(s->time.us, 7);
  EXPECT_EQ(s->position_rad[1], 2);
  EXPECT_EQ(s->velocity_rad_per_s[1], 4);
  EXPECT_EQ(s->reference_rad[1], 6);
  EXPECT_EQ(s->reference_velocity_rad_per_s[1], 8);
  EXPECT_EQ(s->target_rad[1], 10);
  EXPECT_EQ(s->command_time.us, 5);
  EXPECT_EQ(s->command_arrival.us, 6);
  EXPECT_EQ(encode(write_joint_state(*s)), encode(m));
}

TEST(RobotMessages, CommandComesBackAndLettingGoNeedsNoJoints) {
  joint_command_t m{};
  m.utime = 7;
  m.session = 5;
  m.seq = 6;
  m.engaged = 1;
  m.n_joints = 2;
  m.position_rad = {1, 2};
  const JointCommand c = read_command(m);
  EXPECT_EQ(c.time.us, 7);
  EXPECT_EQ(c.session, 5);
  EXPECT_EQ(c.seq, 6);
  EXPECT_TRUE(c.is_engaged);
  EXPECT_EQ(c.position_rad[1], 2);
  EXPECT_EQ(encode(write_command(c)), encode(m));
  for (const int count : {0, kMaxJoints + 1}) {
    m.n_joints = count;
    m.position_rad.assign(static_cast<size_t>(count), 0.5);
    EXPECT_EQ(read_command(m).position_rad.size(), 0) << count;
    EXPECT_EQ(read_command(m).session, 5) << count;
  }
}

TEST(RobotMessages, ControllerStateComesBack) {
  controller_state_t m{};
  m.utime = 7;
  m.state = controller_state_t::STATE_STOPPING;
  m.reason = "why";
  m.driver_session = 5;
  m.needs_release = 1;
  m.commands_of_others = 6;
  m.velocity_limit_rad_per_s = 0.25;
  m.acceleration_limit_rad_per_s2 = 0.75;
  m.limit_margin_rad = 0.125;
  m.command_timeout_s = 0.5;
  const ControllerState s = read_controller_state(m);
  EXPECT_EQ(s.time.us, 7);
  EXPECT_EQ(s.state, ArmState::kStopping);
  EXPECT_EQ(s.reason, "why");
  EXPECT_EQ(s.driver_session, 5);
  EXPECT_TRUE(s.needs_release);
  EXPECT_EQ(s.commands_of_others, 6);
  EXPECT_EQ(s.limits.motion.velocity, 0.25);
  EXPECT_EQ(s.limits.motion.acceleration, 0.75);
  EXPECT_EQ(s.limits.joint_margin_rad, 0.125);
  EXPECT_EQ(s.limits.command_timeout, milliseconds(500));
  controller_state_t back{};
  write_controller_state(s, &back);
  EXPECT_EQ(encode(back), encode(m));
}

TEST(RobotMessages, AlignmentComesBack) {
  alignment_t m{};
  m.state = alignment_t::STATE_ALIGNED;
  m.epoch = 5;
  m.world_from_map_scale_m_per_mu = 0.25;
  set_transform(m.world_from_map_quat_wxyz, m.world_from_map_position_m, 1);
  set_transform(m.ee_from_cam_quat_wxyz, m.ee_from_cam_position_m, 4);
  m.joint_delay_s = 0.0123456789;
  const auto a = read_alignment(m);
  ASSERT_TRUE(a);
  EXPECT_EQ(a->epoch, 5);
  EXPECT_EQ(a->world_from_map.scale(), 0.25);
  EXPECT_EQ(a->world_from_map.translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(a->ee_from_cam.translation(), Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(a->joint_delay_s, 0.0123456789);
  alignment_t back{};
  back.state = m.state;
  write_alignment(*a, &back);
  EXPECT_EQ(encode(back), encode(m));
}

TEST(RobotMessages, BaseComesBack) {
  base_pose_t m{};
  m.utime = 7;
  m.epoch = 5;
  m.state = base_pose_t::STATE_COASTING;
  set_transform(m.world_from_base_quat_wxyz, m.world_from_base_position_m, 1);
  for (int i = 0; i < 3; ++i) {
    m.velocity_m_per_s[i] = 4 + i;
    m.angular_velocity_rad_per_s[i] = 7 + i;
  }
  m.position_sigma_m = 0.25f;
  m.rotation_sigma_rad = 0.75f;
  const auto b = read_base(m);
  ASSERT_TRUE(b);
  EXPECT_EQ(b->time.us, 7);
  EXPECT_EQ(b->epoch, 5);
  EXPECT_EQ(b->tracking, BaseTracking::kCoasting);
  EXPECT_EQ(b->velocity_m_per_s, Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(b->angular_velocity_rad_per_s, Eigen::Vector3d(7, 8, 9));
  EXPECT_EQ(b->position_sigma_m, 0.25);
  EXPECT_EQ(b->rotation_sigma_rad, 0.75);
  EXPECT_EQ(encode(write_base(*b)), encode(m));
  m.state = base_pose_t::STATE_MEASURED;
  EXPECT_EQ(read_base(m)->tracking, BaseTracking::kMeasured);
  EXPECT_EQ(encode(write_base(*read_base(m))), encode(m));
}

}  // namespace
}  // namespace foresight
