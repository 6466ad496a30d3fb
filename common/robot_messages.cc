#include "common/robot_messages.h"

#include <algorithm>
#include <cmath>

namespace foresight {
namespace {

// No alignment says more: a map unit is about the depth of the scene, and calibrator looks for
// delays of up to 0.1 s.
constexpr double kLargestScale = 1e6;  // m/mu, and mu/m
constexpr double kLongestJointDelay_s = 1;

static_assert(static_cast<int8_t>(ArmState::kIdle) == controller_state_t::STATE_IDLE);
static_assert(static_cast<int8_t>(ArmState::kHolding) == controller_state_t::STATE_HOLDING);
static_assert(static_cast<int8_t>(ArmState::kFollowing) == controller_state_t::STATE_FOLLOWING);
static_assert(static_cast<int8_t>(ArmState::kStopping) == controller_state_t::STATE_STOPPING);
static_assert(static_cast<int8_t>(ArmState::kFault) == controller_state_t::STATE_FAULT);

void write_rotation(const Eigen::Quaterniond& rotation, double quat_wxyz[4]) {
  quat_wxyz[0] = rotation.w();
  quat_wxyz[1] = rotation.x();
  quat_wxyz[2] = rotation.y();
  quat_wxyz[3] = rotation.z();
}

void write_vector(const Eigen::Vector3d& vector, double xyz[3]) {
  std::copy_n(vector.data(), 3, xyz);
}

}  // namespace

std::optional<JointVector> read_joints(const std::vector<double>& values) {
  if (values.empty() || values.size() > static_cast<size_t>(kMaxJoints)) return std::nullopt;
  return JointVector(JointVector::Map(values.data(), static_cast<Eigen::Index>(values.size())));
}

std::vector<double> write_joints(const JointVector& values) {
  return {values.data(), values.data() + values.size()};
}

std::optional<Alignment> read_alignment(const alignment_t& m) {
  const double scale = m.world_from_map_scale_m_per_mu;
  const bool valid = m.state == alignment_t::STATE_ALIGNED && scale >= 1 / kLargestScale &&
                     scale <= kLargestScale && std::abs(m.joint_delay_s) <= kLongestJointDelay_s;
  const auto world =
      read_transform<World, Map>(m.world_from_map_quat_wxyz, m.world_from_map_position_m);
  const auto hand = read_transform<Ee, Cam>(m.ee_from_cam_quat_wxyz, m.ee_from_cam_position_m);
  if (!valid || !world || !hand) return std::nullopt;
  return Alignment{.epoch = m.epoch,
                   .world_from_map = {scale, world->rotation(), world->translation()},
                   .ee_from_cam = *hand,
                   .joint_delay_s = m.joint_delay_s};
}

void write_alignment(const Alignment& a, alignment_t* m) {
  m->epoch = a.epoch;
  m->world_from_map_scale_m_per_mu = a.world_from_map.scale();
  write_rotation(a.world_from_map.rotation(), m->world_from_map_quat_wxyz);
  write_vector(a.world_from_map.translation(), m->world_from_map_position_m);
  write_transform(a.ee_from_cam, m->ee_from_cam_quat_wxyz, m->ee_from_cam_position_m);
  m->joint_delay_s = a.joint_delay_s;
}

std::optional<BaseState> read_base(const base_pose_t& m) {
  const auto pose =
      read_transform<World, Base>(m.world_from_base_quat_wxyz, m.world_from_base_position_m);
  if (!pose) return std::nullopt;
  return BaseState{.time = {m.utime},
                   .epoch = m.epoch,
                   .world_from_base = *pose,
                   .velocity_m_per_s = Eigen::Vector3d(m.velocity_m_per_s),
                   .angular_velocity_rad_per_s = Eigen::Vector3d(m.angular_velocity_rad_per_s),
                   .tracking = m.state == base_pose_t::STATE_COASTING ? BaseTracking::kCoasting
                                                                      : BaseTracking::kMeasured,
                   .position_sigma_m = m.position_sigma_m,
                   .rotation_sigma_rad = m.rotation_sigma_rad};
}

base_pose_t write_base(const BaseState& b) {
  base_pose_t m{};
  m.utime = b.time.us;
  m.epoch = b.epoch;
  m.state = b.tracking == BaseTracking::kMeasured ? base_pose_t::STATE_MEASURED
                                                  : base_pose_t::STATE_COASTING;
  write_transform(b.world_from_base, m.world_from_base_quat_wxyz, m.world_from_base_position_m);
  write_vector(b.velocity_m_per_s, m.velocity_m_per_s);
  write_vector(b.angular_velocity_rad_per_s, m.angular_velocity_rad_per_s);
  m.position_sigma_m = static_cast<float>(b.position_sigma_m);
  m.rotation_sigma_rad = static_cast<float>(b.rotation_sigma_rad);
  return m;
}

JointCommand read_command(const joint_command_t& m) {
  return {.time = {m.utime},
          .session = m.session,
          .seq = m.seq,
          .is_engaged = m.engaged != 0,
          .position_rad = read_joints(m.position_rad).value_or(JointVector())};
}

joint_command_t write_command(const JointCommand& c) {
  joint_command_t m{};
  m.utime = c.time.us;
  m.session = c.session;
  m.seq = c.seq;
  m.engaged = c.is_engaged ? 1 : 0;
  m.n_joints = static_cast<int32_t>(c.position_rad.size());
  m.position_rad = write_joints(c.position_rad);
  return m;
}

std::optional<JointState> read_joint_state(const joint_state_t& m) {
  const auto position = read_joints(m.position_rad);
  const auto velocity = read_joints(m.velocity_rad_per_s);
  const auto reference = read_joints(m.reference_position_rad);
  const auto reference_velocity = read_joints(m.reference_velocity_rad_per_s);
  const auto target = read_joints(m.target_position_rad);
  if (!position || !velocity || !reference || !reference_velocity || !target) return std::nullopt;
  return JointState{.time = {m.utime},
                    .position_rad = *position,
                    .velocity_rad_per_s = *velocity,
                    .reference_rad = *reference,
                    .reference_velocity_rad_per_s = *reference_velocity,
                    .target_rad = *target,
                    .command_time = {m.command_utime},
                    .command_arrival = {m.command_arrival_utime}};
}

joint_state_t write_joint_state(const JointState& s) {
  joint_state_t m{};
  m.utime = s.time.us;
  m.n_joints = static_cast<int32_t>(s.position_rad.size());
  m.position_rad = write_joints(s.position_rad);
  m.velocity_rad_per_s = write_joints(s.velocity_rad_per_s);
  m.reference_position_rad = write_joints(s.reference_rad);
  m.reference_velocity_rad_per_s = write_joints(s.reference_velocity_rad_per_s);
  m.target_position_rad = write_joints(s.target_rad);
  m.command_utime = s.command_time.us;
  m.command_arrival_utime = s.command_arrival.us;
  return m;
}

ControllerState read_controller_state(const controller_state_t& m) {
  return {.time = {m.utime},
          .state = static_cast<ArmState>(m.state),
          .reason = m.reason,
          .driver_session = m.driver_session,
          .needs_release = m.needs_release != 0,
          .commands_of_others = m.commands_of_others,
          .limits = {.motion = {.velocity = m.velocity_limit_rad_per_s,
                                .acceleration = m.acceleration_limit_rad_per_s2},
                     .joint_margin_rad = m.limit_margin_rad,
                     .command_timeout = seconds(std::clamp(m.command_timeout_s, 0.0, 1e6))}};
}

void write_controller_state(const ControllerState& s, controller_state_t* m) {
  m->utime = s.time.us;
  m->state = static_cast<int8_t>(s.state);
  m->reason = s.reason;
  m->driver_session = s.driver_session;
  m->needs_release = s.needs_release ? 1 : 0;
  m->commands_of_others = s.commands_of_others;
  m->velocity_limit_rad_per_s = s.limits.motion.velocity;
  m->acceleration_limit_rad_per_s2 = s.limits.motion.acceleration;
  m->limit_margin_rad = s.limits.joint_margin_rad;
  m->command_timeout_s = s.limits.command_timeout.seconds();
}

}  // namespace foresight
