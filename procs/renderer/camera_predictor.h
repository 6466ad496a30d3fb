// Where the camera will be when the operator's newest command has reached the robot (paper §II-B).
//
// The robot, not the hand, is predicted: the arm's controller turns commands into trapezoidal
// profiles with bounded velocity and acceleration, and this class runs the very same profiles
// (common/joint_reference.h) from the newest delayed JOINT_STATE with the commands that were still
// on their way when it was measured. The base is carried on with its last known velocity.
//
//   CameraPredictor predictor(arm, options);
//   predictor.set_alignment(...); predictor.set_base(...);      // delayed, from the robot
//   predictor.set_joint_state(...); predictor.set_controller(...);
//   predictor.add_command(...);                                 // at once, from the operator
//   if (auto p = predictor.predict(now)) draw(p->map_from_cam);
//   else say(predictor.reason());
//
// All time-stamps are of one clock (or of clocks kept together).
#pragma once

#include <deque>
#include <optional>
#include <string>

#include "common/arm_model.h"
#include "common/frames.h"
#include "common/joint_reference.h"
#include "common/time.h"

namespace foresight {

enum class PredictedJoints {
  kRobot,    // what the controller will have made of the commands
  kCommand,  // the commanded joints themselves, as in the paper: ahead of the arm's limits
};

struct CameraPredictorOptions {
  PredictedJoints joints = PredictedJoints::kRobot;
  // Those of wam_controller.
  MotionLimits limits;
  double joint_margin_rad = 0.05;
  Duration command_timeout = milliseconds(500);
  // The base's velocity is trusted for so long.
  Duration longest_extrapolation = milliseconds(1500);
};

/// What the operator's site knows of the robot; as in common/robot_messages.h.
struct CommandedJoints {
  Time time;
  int64_t session = 0;
  bool engaged = false;
  JointVector position_rad;
};
struct MeasuredJoints {
  Time time;
  JointVector position_rad, reference_rad, reference_velocity_rad_per_s, target_rad;
  Time command_time, command_arrival;  // of the newest command that the reference knows; 0: none
};
struct MapInWorld {
  int64_t epoch = 0;
  Similarity<World, Map> world_from_map;
  Pose<Ee, Cam> ee_from_cam;
};
struct BaseMotion {
  Time time;
  int64_t epoch = 0;
  Pose<World, Base> world_from_base;
  Eigen::Vector3d velocity_m_per_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity_rad_per_s = Eigen::Vector3d::Zero();
};

struct PredictedCamera {
  Time instant;       // that is predicted: when a command given now reaches the robot
  Time command_time;  // of the newest command in it; 0: none
  int64_t epoch = 0;
  JointVector position_rad;
  Pose<World, Base> world_from_base;
  Pose<World, Cam> world_from_cam;
  Pose<Map, Cam> map_from_cam;
};

class CameraPredictor {
 public:
  CameraPredictor(const ArmModel& arm, const CameraPredictorOptions& options);

  /// False: not of this arm, or older than one that is known; ignored.
  bool add_command(const CommandedJoints& command);
  bool set_joint_state(const MeasuredJoints& state);
  void set_alignment(const MapInWorld& alignment) { alignment_ = alignment; }
  /// False: older than one that is known; ignored.
  bool set_base(const BaseMotion& base);
  /// `powered` is false while the controller applies no torque (idle, fault): commands then move
  /// nothing.
  void set_powered(bool powered) { powered_ = powered; }

  std::optional<PredictedCamera> predict(Time now);
  /// Why predict() returned nothing.
  const std::string& reason() const { return reason_; }
  /// How long commands travel to the robot: the median of the last ones; 0 before the first.
  Duration command_delay() const;

 private:
  JointVector predict_joints(Time instant) const;
  JointVector run_reference(Time instant) const;
  Pose<World, Base> predict_base(Time instant) const;
  void find_base_acceleration();

  ArmModel arm_;
  CameraPredictorOptions options_;
  std::deque<CommandedJoints> commands_;  // by time; those that the joint state does not know yet
  std::deque<Duration> delays_;
  std::optional<MeasuredJoints> state_;
  std::optional<MapInWorld> alignment_;
  std::optional<BaseMotion> base_;
  std::deque<BaseMotion> recent_bases_;
  Eigen::Vector3d base_acceleration_m_per_s2_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d base_angular_acceleration_rad_per_s2_ = Eigen::Vector3d::Zero();
  bool powered_ = true;
  std::string reason_;
};

}  // namespace foresight
