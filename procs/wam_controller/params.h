#pragma once

#include <string>
#include <vector>

#include "common/params.h"

namespace foresight {

enum class Hardware { kSim, kCan };
constexpr auto names_of(Hardware) {
  return std::array{EnumName{Hardware::kSim, "sim"}, EnumName{Hardware::kCan, "can"}};
}

struct WamControllerParams {
  std::string arm_file = "deploy/arms/wam4.yaml";
  Hardware hardware = Hardware::kSim;
  std::string can_interface = "can0";
  std::vector<double> can_torque_units_per_nm;
  double can_home_confirmed_at_s = 0;
  std::string can_home_file = "out/run/can_home.txt";
  double velocity_limit_rad_per_s = 1;
  double acceleration_limit_rad_per_s2 = 1;
  double limit_margin_rad = 0.05;
  double command_timeout_s = 0.5;
  double command_max_age_s = 2;
  double encoder_timeout_s = 0.1;
  double encoder_jump_rad_per_s = 20;
  double tracking_error_limit_rad = 0.15;
  double weight_tolerance_nm = 3;
  double velocity_filter_hz = 100;
  bool inertia_feed_forward = true;
  double base_roll_rad = 0;
  double base_pitch_rad = 0;
  double joint_state_rate_hz = 100;
  bool realtime = true;

  template <class V>
  void visit(V& v) {
    v("arm_file", arm_file, {.doc = "description file of the arm (deploy/arms)"});
    v("hardware", hardware,
      {.doc = "sim: ARM_ENCODERS in, ARM_TORQUES out; can: the arm's CAN bus"});
    v("can_interface", can_interface, {.doc = "network interface of the CAN bus"});
    v("can_torque_units_per_nm", can_torque_units_per_nm,
      {.doc = "of each motor: the pucks' property IPNM (needed by can)"});
    v("can_home_confirmed_at_s", can_home_confirmed_at_s,
      {.unit = "s",
       .min = 0,
       .max = 1e11,
       .doc =
           "can: when you saw the arm in the home position of its file: $(date +%s). Counts once, "
           "for 15 minutes, and is needed after the motor controllers were switched on"});
    v("can_home_file", can_home_file,
      {.doc = "can: where the motors' zero is kept for a restart while they keep counting"});
    v("velocity_limit_rad_per_s", velocity_limit_rad_per_s,
      {.unit = "rad/s", .min = 0.01, .max = 10, .doc = "of the reference of each joint"});
    v("acceleration_limit_rad_per_s2", acceleration_limit_rad_per_s2,
      {.unit = "rad/s^2", .min = 0.01, .max = 100, .doc = "of the reference of each joint"});
    v("limit_margin_rad", limit_margin_rad,
      {.unit = "rad", .min = 0, .max = 1, .doc = "targets stay this far inside the joint limits"});
    v("command_timeout_s", command_timeout_s,
      {.unit = "s", .min = 0.02, .max = 60, .doc = "ramps down when commands stop for this long"});
    v("command_max_age_s", command_max_age_s,
      {.unit = "s",
       .min = 0.1,
       .max = 600,
       .doc = "drops commands whose stamp is further than this from now"});
    v("encoder_timeout_s", encoder_timeout_s,
      {.unit = "s", .min = 0.005, .max = 5, .doc = "idle when readings stop for this long"});
    v("encoder_jump_rad_per_s", encoder_jump_rad_per_s,
      {.unit = "rad/s", .min = 1, .max = 1000, .doc = "a joint that seems faster is a fault"});
    v("tracking_error_limit_rad", tracking_error_limit_rad,
      {.unit = "rad", .min = 0.001, .max = 3, .doc = "a joint further from its reference: fault"});
    v("weight_tolerance_nm", weight_tolerance_nm,
      {.unit = "N*m",
       .min = 0.1,
       .max = 1000,
       .doc = "an arm that takes another torque to hold than its weight by more follows nobody"});
    v("velocity_filter_hz", velocity_filter_hz,
      {.unit = "Hz", .min = 1, .max = 250, .doc = "corner of the low pass on joint velocities"});
    v("inertia_feed_forward", inertia_feed_forward,
      {.doc = "adds the torques that the reference's motion takes, not only gravity's"});
    v("base_roll_rad", base_roll_rad,
      {.unit = "rad", .min = -3.2, .max = 3.2, .doc = "tilt of the base about its x axis"});
    v("base_pitch_rad", base_pitch_rad,
      {.unit = "rad", .min = -3.2, .max = 3.2, .doc = "tilt of the base about y, after the roll"});
    v("joint_state_rate_hz", joint_state_rate_hz,
      {.unit = "Hz", .min = 1, .max = 500, .doc = "of JOINT_STATE"});
    v("realtime", realtime,
      {.doc = "real-time scheduling and locked memory where they are permitted"});
  }
};

}  // namespace foresight
