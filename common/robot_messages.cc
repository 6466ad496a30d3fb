#include "common/robot_messages.h"

#include <cmath>

namespace foresight {
namespace {

// No alignment says more: a map unit is about the depth of the scene, and calibrator looks for
// delays of up to 0.1 s.
constexpr double kLargestScale = 1e6;  // m/mu, and mu/m
constexpr double kLongestJointDelay_s = 1;

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
  return Alignment{
      m.epoch, {scale, world->rotation(), world->translation()}, *hand, seconds(m.joint_delay_s)};
}

std::optional<BaseState> read_base(const base_pose_t& m) {
  const auto pose =
      read_transform<World, Base>(m.world_from_base_quat_wxyz, m.world_from_base_position_m);
  if (!pose) return std::nullopt;
  return BaseState{{m.utime},
                   m.epoch,
                   *pose,
                   Eigen::Vector3d(m.velocity_m_per_s),
                   Eigen::Vector3d(m.angular_velocity_rad_per_s),
                   m.state == base_pose_t::STATE_COASTING};
}

std::optional<JointCommand> read_command(const joint_command_t& m) {
  const auto joints = read_joints(m.position_rad);
  if (!joints) return std::nullopt;
  return JointCommand{{m.utime}, m.session, m.seq, m.engaged != 0, *joints};
}

std::optional<JointState> read_joint_state(const joint_state_t& m) {
  const auto position = read_joints(m.position_rad);
  const auto velocity = read_joints(m.velocity_rad_per_s);
  const auto reference = read_joints(m.reference_position_rad);
  const auto reference_velocity = read_joints(m.reference_velocity_rad_per_s);
  const auto target = read_joints(m.target_position_rad);
  if (!position || !velocity || !reference || !reference_velocity || !target) return std::nullopt;
  return JointState{{m.utime},           *position, *velocity,         *reference,
                    *reference_velocity, *target,   {m.command_utime}, {m.command_arrival_utime}};
}

}  // namespace foresight
