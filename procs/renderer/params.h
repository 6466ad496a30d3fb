#pragma once

#include <string>

#include "common/params.h"
#include "procs/renderer/hud.h"
#include "procs/renderer/scene_renderer.h"

namespace foresight {

enum class Display { kAuto, kWindow, kHeadless };
constexpr auto names_of(Display) {
  return std::array{EnumName{Display::kAuto, "auto"}, EnumName{Display::kWindow, "window"},
                    EnumName{Display::kHeadless, "headless"}};
}
constexpr auto names_of(Layout) {
  return std::array{EnumName{Layout::kSideBySide, "side_by_side"},
                    EnumName{Layout::kPredicted, "predicted"},
                    EnumName{Layout::kDelayed, "delayed"}, EnumName{Layout::kInset, "inset"},
                    EnumName{Layout::kUndelayed, "undelayed"}};
}
enum class Predict { kCameraPose, kRobot, kCommand };
constexpr auto names_of(Predict) {
  return std::array{EnumName{Predict::kCameraPose, "camera_pose"},
                    EnumName{Predict::kRobot, "robot"}, EnumName{Predict::kCommand, "command"}};
}

struct RendererParams {
  Display display = Display::kAuto;
  Layout layout = Layout::kSideBySide;
  Predict predict = Predict::kCameraPose;
  std::string arm_file = "deploy/arms/wam4.yaml";
  double velocity_limit_rad_per_s = 1;
  double acceleration_limit_rad_per_s2 = 1;
  double limit_margin_rad = 0.05;
  double command_timeout_s = 0.5;
  double joint_state_timeout_s = 1;
  bool undelayed_video = false;
  int picture_width_px = 640;
  double idle_rate_hz = 5;
  int stored_views = SceneOptions{}.stored_views;
  int used_views = RenderOptions{}.used_views;
  bool paint_guesses = true;
  double least_confidence = RenderOptions{}.least_confidence;
  std::string record;
  double record_fps = 15;

  template <class V>
  void visit(V& v) {
    v("display", display,
      {.doc = "a window, or off screen; auto: a window when there is a display"});
    v("layout", layout,
      {.doc = "1 delayed video, 2 predicted view, 3 side by side, 4 predicted with the delayed "
              "video inset, 5 undelayed video (keys)"});
    v("predict", predict,
      {.doc = "the pose to draw: the newest undelayed CAMERA_POSE (recorded video); where the arm "
              "will be, its controller's profile included; or the commanded joints themselves"});
    v("arm_file", arm_file, {.doc = "arm description, for robot and command"});
    v("velocity_limit_rad_per_s", velocity_limit_rad_per_s,
      {.unit = "rad/s",
       .min = 0.01,
       .max = 10,
       .doc = "of the controller's profile, until CONTROLLER_STATE tells it"});
    v("acceleration_limit_rad_per_s2", acceleration_limit_rad_per_s2,
      {.unit = "rad/s^2",
       .min = 0.01,
       .max = 100,
       .doc = "of the controller's profile, until CONTROLLER_STATE tells it"});
    v("limit_margin_rad", limit_margin_rad,
      {.unit = "rad",
       .min = 0,
       .max = 1,
       .doc = "the controller keeps from joint limits, until CONTROLLER_STATE tells it"});
    v("command_timeout_s", command_timeout_s,
      {.unit = "s",
       .min = 0.02,
       .max = 60,
       .doc = "after which the controller stops the arm, until CONTROLLER_STATE tells it"});
    v("joint_state_timeout_s", joint_state_timeout_s,
      {.unit = "s",
       .min = 0.05,
       .max = 60,
       .doc =
           "silence of JOINT_STATE, beyond its usual interval, after which nothing is predicted"});
    v("undelayed_video", undelayed_video,
      {.doc = "also read VIEW on the robot's side, for layout undelayed (comparisons)"});
    v("picture_width_px", picture_width_px,
      {.unit = "px", .min = 64, .max = 4096, .doc = "width of one picture"});
    v("idle_rate_hz", idle_rate_hz,
      {.unit = "Hz",
       .min = 0.2,
       .max = 60,
       .doc = "redraws per second while no new pose arrives; a new pose is drawn at once"});
    v("stored_views", stored_views,
      {.unit = "1", .min = 1, .max = 64, .doc = "delayed images kept as textures"});
    v("used_views", used_views,
      {.unit = "1", .min = 1, .max = 8, .doc = "textures used in one picture, newest first"});
    v("paint_guesses", paint_guesses,
      {.doc = "paint images also where no surface was measured (background)"});
    v("least_confidence", least_confidence,
      {.unit = "1",
       .min = 0,
       .max = 1,
       .doc = "surface whose points are less sure counts as guessed; 0.8: 2.5 % of the depth"});
    v("record", record,
      {.doc = "FILE.mp4, or FOLDER/%05d.png: writes what is shown (by ffmpeg); empty: nothing"});
    v("record_fps", record_fps, {.unit = "Hz", .min = 1, .max = 120, .doc = "of the recording"});
  }
};

}  // namespace foresight
