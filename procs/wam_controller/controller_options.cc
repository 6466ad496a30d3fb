#include "procs/wam_controller/controller_options.h"

#include <Eigen/Geometry>

#include "common/errors.h"

namespace foresight {
namespace {

constexpr double kGravity_m_per_s2 = 9.81;

}  // namespace

ControllerOptions options_of(const WamControllerParams& p) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  const Eigen::Matrix3d level_from_base = (AngleAxisd(p.base_pitch_rad, Vector3d::UnitY()) *
                                           AngleAxisd(p.base_roll_rad, Vector3d::UnitX()))
                                              .toRotationMatrix();
  return {
      .limits = {.motion = {p.velocity_limit_rad_per_s, p.acceleration_limit_rad_per_s2},
                 .joint_margin_rad = p.limit_margin_rad,
                 .command_timeout = seconds(p.command_timeout_s)},
      .command_max_age = seconds(p.command_max_age_s),
      .encoder_timeout = seconds(p.encoder_timeout_s),
      .encoder_jump_rad_per_s = p.encoder_jump_rad_per_s,
      .tracking_error_limit_rad = p.tracking_error_limit_rad,
      .velocity_filter_hz = p.velocity_filter_hz,
      .inertia_feed_forward = p.inertia_feed_forward,
      .gravity_in_base_m_per_s2 = level_from_base.transpose() * Vector3d(0, 0, -kGravity_m_per_s2),
      .weight_tolerance_nm = p.weight_tolerance_nm,
      .is_weighed_first = p.hardware == Hardware::kCan};
}

void check_margin(const ArmModel& arm, const WamControllerParams& params) {
  for (const ArmJoint& joint : arm.joints) {
    if (joint.upper_rad - joint.lower_rad > 2 * params.limit_margin_rad) continue;
    throw ConfigError("limit_margin_rad: leaves a joint of " + params.arm_file + " no room");
  }
}

}  // namespace foresight
