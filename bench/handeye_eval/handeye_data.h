// Recorded hand-eye data: the robot's poses, and the camera's by a calibration target that plays
// the role of the SLAM map.
//
// Two layouts. Views of a target: robot_poses.txt (base_from_flange: index tx ty tz qx qy qz qw),
// corners.txt (view X Y Z u v), camera.yaml, handeye.yaml (a reference). A log: base_T_hinge.txt
// and target_T_camera.txt (time tx ty tz qx qy qz qw), without images.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/camera_model.h"
#include "procs/calibrator/arm_track.h"

namespace foresight {

struct Target {};  // frame of the calibration target, m

struct TargetCorner {
  Eigen::Vector3d point_in_target;  // m
  Eigen::Vector2d pixel;            // as detected, lens distortion included
};

struct HandEyeView {
  calibration::ArmTrack arm;
  Pose<Target, Cam> target_from_cam;  // of a log: as given; of views: by PnP
  std::vector<TargetCorner> corners;  // empty in a log
};

struct HandEyeData {
  std::string name;
  CameraModel camera;  // of a log: one that is made up, for the reprojection objective
  std::vector<HandEyeView> views;
  std::vector<Eigen::Vector3d> points_in_target;  // samples of the scene
  std::optional<Pose<Ee, Cam>> reference;         // where the data's maker says that the camera is
  bool is_log = false;                            // with times: a delay can be estimated
};

/// Takes every `step`-th pose of a log. Throws UnavailableError or ConfigError with file and line.
HandEyeData load_handeye(const std::string& folder, int step);

}  // namespace foresight
