// Where the camera will be when the operator's newest command has reached the robot (paper §II-B).
//
// The robot, not the hand, is predicted: the arm's controller turns commands into trapezoidal
// profiles with bounded velocity and acceleration, and this class runs the very same profiles
// (common/joint_reference.h) from the newest delayed JOINT_STATE with the commands that were still
// on their way when it was measured. The base is carried on with its last known velocity.
//
//   CameraPredictor predictor(arm, options);
//   predictor.set_alignment(...); predictor.set_base(now, ...);      // delayed, from the robot
//   predictor.set_joint_state(now, ...); predictor.set_controller(now, ...);
//   predictor.add_command(now, ...);                                 // at once, from the operator
//   if (auto p = predictor.predict(now)) draw(p->map_from_cam);
//   else say(predictor.reason());
//
// Of several senders the arm follows one: the one that CONTROLLER_STATE names, or that has engaged
// since by the controller's rule (command_sessions.h). Limits are those that CONTROLLER_STATE
// tells, from the first on.
//
// It stops rather than guess: without fresh JOINT_STATE, and when the two sites' clocks disagree
// (common/clock_offset.h). No single message bends it for good: stamps are judged by
// common/newest_stamp.h, an epoch and limits that differ from the last must persist.
#pragma once

#include <deque>
#include <optional>
#include <string>

#include "common/arm_model.h"
#include "common/clock_offset.h"
#include "common/frames.h"
#include "common/joint_reference.h"
#include "common/newest_stamp.h"
#include "common/persistent_value.h"
#include "common/robot_types.h"
#include "common/time.h"
#include "procs/renderer/command_sessions.h"
#include "procs/renderer/stream_watch.h"

namespace foresight {

enum class PredictedJoints {
  kRobot,    // what the controller will have made of the commands
  kCommand,  // the commanded joints themselves, as in the paper: ahead of the arm's limits
};

struct CameraPredictorOptions {
  PredictedJoints joints = PredictedJoints::kRobot;
  ControllerLimits limits = {};  // until the controller tells its own
  // The base's velocity is trusted for so long.
  Duration longest_extrapolation = milliseconds(1500);
  // Silence of JOINT_STATE, beyond its usual interval, after which nothing is predicted.
  Duration longest_silence = seconds(1);
  // Nothing is predicted while the clocks differ by more, or seem to, nor so soon after a step.
  Duration clock_tolerance = milliseconds(50);
  Duration step_settles = seconds(2);
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

  /// `now`: when it arrived, also below.
  [[nodiscard]] CommandIntake add_command(Time now, const JointCommand& command);
  /// False: ignored, because it is of another arm, makes no sense, or is older than what is known
  /// and not of a stream that keeps coming. Also below.
  [[nodiscard]] bool set_joint_state(Time now, const JointState& state);
  [[nodiscard]] bool set_controller(Time now, const ControllerState& controller);
  [[nodiscard]] bool set_base(Time now, const BaseState& base);
  /// False: of another map than the last and than BASE_POSE; counts when it is stated again.
  [[nodiscard]] bool set_alignment(const Alignment& alignment);

  std::optional<PredictedCamera> predict(Time now);
  /// Why predict() returned nothing.
  const std::string& reason() const { return reason_; }
  /// From the operator's stamp to the robot's: the median of the last commands; 0 before the first.
  /// Below 0 where the clocks disagree.
  Duration command_delay() const { return median(delays_); }
  const ClockOffset& clocks() const { return clocks_; }
  ControllerLimits limits() const { return limits_.value().value_or(options_.limits); }
  /// Who else commands the arm, for people; else empty.
  std::string commanders_complaint(Time now) const;
  /// Where the controller's limits are not those of the options; else empty.
  std::string limits_note() const;

 private:
  struct Forecast {
    JointVector position_rad;
    int64_t driver = 0;  // at that instant
  };
  std::string missing(Time now) const;
  void watch_clocks(Time now);
  std::string clock_doubt(Time now) const;
  int64_t known_driver() const;
  DriverRule::Start driver_then(Time command_time) const;
  Time arrival_of(const JointCommand& command) const;
  Forecast run_reference(Time instant) const;
  Pose<World, Base> predict_base(Time instant) const;
  void find_base_acceleration();

  ArmModel arm_;
  CameraPredictorOptions options_;
  CommandSessions commands_;
  std::deque<Duration> delays_;
  ClockOffset clocks_;
  LatencyJump downlink_;
  std::optional<Time> step_time_;
  StreamWatch state_watch_;
  NewestStamp state_order_, controller_order_, base_order_;
  std::optional<JointState> state_;
  std::optional<ControllerState> controller_;
  PersistentValue<ControllerLimits> limits_;
  std::optional<Alignment> alignment_, newest_alignment_;
  PersistentValue<int64_t> alignment_epoch_{2}, base_epoch_;
  std::optional<BaseState> base_;
  std::deque<BaseState> recent_bases_;
  Eigen::Vector3d base_acceleration_m_per_s2_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d base_angular_acceleration_rad_per_s2_ = Eigen::Vector3d::Zero();
  std::string reason_;
};

}  // namespace foresight
