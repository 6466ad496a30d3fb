#pragma once

#include <string>

#include "common/params.h"
#include "procs/omni/clutch.h"
#include "procs/omni/joint_commander.h"
#include "procs/omni/script_motion.h"

namespace foresight {

enum class DeviceKind {
  kScript,
  kWaypoints,
  kRecorded,
  kOpenHaptics,
  kGamepad,
  kKeyboard,
  kSpaceMouse,
};
constexpr auto names_of(DeviceKind) {
  using enum DeviceKind;
  return std::array{EnumName{kScript, "script"},        EnumName{kWaypoints, "waypoints"},
                    EnumName{kRecorded, "recorded"},    EnumName{kOpenHaptics, "openhaptics"},
                    EnumName{kGamepad, "gamepad"},      EnumName{kKeyboard, "keyboard"},
                    EnumName{kSpaceMouse, "spacemouse"}};
}
constexpr auto names_of(MotionMode) {
  return std::array{EnumName{MotionMode::kAbsolute, "absolute"},
                    EnumName{MotionMode::kRelative, "relative"}};
}
constexpr auto names_of(ClutchMode) {
  return std::array{EnumName{ClutchMode::kHold, "hold"}, EnumName{ClutchMode::kToggle, "toggle"}};
}

struct OmniParams {
  DeviceKind device = DeviceKind::kScript;
  std::string device_path;
  std::string arm_file = "deploy/arms/wam4.yaml";
  std::string mapping_file;
  ClutchMode clutch = ClutchMode::kHold;
  int clutch_button = 0;
  double rate_hz = 30;
  CommanderOptions commander;
  double dead_zone = 0.1;
  double key_hold_s = 0.2;
  double start_delay_s = 1;
  bool loop = false;
  bool exit_at_end = false;
  bool resume = false;
  double stick_silence_s = 3;
  double robot_silence_s = 1;
  double longest_round_trip_s = 5;
  ScriptOptions script;

  template <class V>
  void visit(V& v) {
    v("device", device, {.doc = "what the operator moves; script moves by itself"});
    v("device_path", device_path,
      {.doc = "gamepad: device file ('': /dev/input/js0); keyboard: terminal or FIFO ('': standard "
              "input); waypoints, recorded: the file; openhaptics: the device's name"});
    v("arm_file", arm_file, {.doc = "description of the arm that is commanded"});
    v("mapping_file", mapping_file,
      {.doc =
           "from device axes to joints (deploy/mappings/*.yaml); '': the paper's, or that of the "
           "device"});
    v("mode", commander.mode,
      {.doc =
           "of devices with joints: the arm goes where the device points, or follows its motion"});
    v("rate_hz", rate_hz, {.unit = "Hz", .min = 1, .max = 200, .doc = "of readings and commands"});
    visit_hand(v);
    visit_robot(v);
    visit_commander(v);
    visit_script(v);
  }

 private:
  template <class V>
  void visit_hand(V& v) {
    v("clutch", clutch,
      {.doc = "of the clutch button: engaged while it is held, or each press changes it"});
    v("clutch_button", clutch_button,
      {.unit = "1",
       .min = 0,
       .max = 64,
       .doc = "number of the button, from 1; 0: the device's (gamepad 6, others 1)"});
    v("dead_zone", dead_zone,
      {.unit = "1", .min = 0, .max = 0.9, .doc = "deflection of a stick that counts as none"});
    v("key_hold_s", key_hold_s,
      {.unit = "s",
       .min = 0.05,
       .max = 2,
       .doc = "a key counts as held so long after it was typed"});
    v("stick_silence_s", stick_silence_s,
      {.unit = "s",
       .min = 0.5,
       .max = 60,
       .doc = "gamepad: a deflected stick without any event for so long counts as let go"});
  }
  template <class V>
  void visit_robot(V& v) {
    v("robot_silence_s", robot_silence_s,
      {.unit = "s",
       .min = 0.2,
       .max = 10,
       .doc = "without JOINT_STATE or CONTROLLER_STATE for so long the clutch counts as let go"});
    v("longest_round_trip_s", longest_round_trip_s,
      {.unit = "s",
       .min = 0.5,
       .max = 60,
       .doc = "an engagement that the robot has not followed by then counts as let go"});
  }
  template <class V>
  void visit_commander(V& v) {
    v("max_velocity_rad_per_s", commander.max_velocity_rad_per_s,
      {.unit = "rad/s", .min = 0.01, .max = 10, .doc = "of each joint of a command"});
    v("align_velocity_rad_per_s", commander.align_velocity_rad_per_s,
      {.unit = "rad/s",
       .min = 0.01,
       .max = 10,
       .doc =
           "after engaging in absolute mode: at which the arm comes to where the device points"});
    v("axis_velocity_rad_per_s", commander.axis_velocity_rad_per_s,
      {.unit = "rad/s", .min = 0.01, .max = 2, .doc = "at full deflection of a stick or a key"});
    v("limit_margin_rad", commander.limit_margin_rad,
      {.unit = "rad", .min = 0, .max = 0.5, .doc = "commands stay so far inside the joint limits"});
  }
  template <class V>
  void visit_script(V& v) {
    v("start_delay_s", start_delay_s,
      {.unit = "s", .min = 0, .max = 1e4, .doc = "before script, waypoints and recorded begin"});
    v("loop", loop, {.doc = "waypoints, recorded: begin again at the end"});
    v("exit_at_end", exit_at_end, {.doc = "waypoints, recorded: end the process at the end"});
    v("resume", resume,
      {.doc = "waypoints, recorded: go on by themselves after the robot stopped following"});
    v("script_seed", script.seed, {.unit = "1", .min = 0, .max = 2e9, .doc = "of the motion"});
    v("script_warm_up", script.warm_up,
      {.doc = "begin with sweeps of each axis, for slam's start and the calibration"});
    v("script_range_rad", script.range_rad,
      {.unit = "rad",
       .min = 0.01,
       .max = 3,
       .doc = "of each joint of the arm, on either side of home"});
    v("script_peak_rad_per_s", script.peak_rad_per_s,
      {.unit = "rad/s", .min = 0.02, .max = 1, .doc = "no joint of the arm goes faster"});
    v("script_move_s", script.move_s, {.unit = "s", .min = 4, .max = 1e4, .doc = "moving, then …"});
    v("script_hold_s", script.hold_s,
      {.unit = "s",
       .min = 0,
       .max = 1e3,
       .doc = "… holding still, in turns; 0: never holds still"});
  }
};

}  // namespace foresight
