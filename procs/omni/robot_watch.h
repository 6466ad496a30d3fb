// Whether the robot is ready to be driven by this operator, and whether it does follow him, from
// what it says about itself. While it is not, the clutch counts as let go: what the hand does
// meanwhile must not wait for the arm.
//
//   RobotWatch robot({}, arm.size());
//   robot.on_joints(now, state.time, state.command_time);   // JOINT_STATE
//   robot.on_report(now, report);                           // CONTROLLER_STATE
//   const bool may_engage = robot.obstacle(now).empty();    // or: may stay engaged
//   robot.on_command(now, command.utime, is_engaged);       // each command that is sent
//
// What the robot says is late, so what it said before it knew of an engagement is no answer to it.
// It knows when JOINT_STATE names a command that is as new as the engagement (command_utime, a
// stamp of our own clock); an answer is a CONTROLLER_STATE that is at least as new as that
// JOINT_STATE (both stamps are the robot's). So no clocks are compared. Once the answer was
// FOLLOWING, any other state ends the engagement. Without such an answer it ends after two round
// trips and half a second, or after `longest_round_trip` when that is shorter or no round trip is
// known. IDLE, FAULT, needs_release, another driver and silence end it at once: one may engage only
// after the robot was said to be ready, so these are newer than that.
//
// Times of arrival must not go back (SteadyTime). Nothing throws; O(1).
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/robot_types.h"
#include "common/time.h"

namespace foresight {

struct RobotWatchOptions {
  Duration silence = seconds(1.0);             // of either message: the robot is not there
  Duration longest_round_trip = seconds(5.0);  // that an engagement waits for its answer
};

class RobotWatch {
 public:
  RobotWatch(const RobotWatchOptions& options, int joint_count)
      : options_(options), joint_count_(joint_count) {}

  /// Our commands carry this session from now on.
  void begin_session(int64_t session) { session_ = session; }
  /// `robot_time`: by the robot's clock; `command_time`: ours, of the newest command that it had
  /// dealt with. `round_trip`: of messages, when it is known.
  void on_joints(Time arrival, Time robot_time, Time command_time,
                 std::optional<Duration> round_trip);
  /// A JOINT_STATE of an arm with another number of joints.
  void on_other_arm(Time arrival, int joint_count);
  void on_report(Time arrival, const ControllerState& report);
  /// `stamp`: the command's utime.
  void on_command(Time now, Time stamp, bool is_engaged);

  /// One line that says why the clutch counts as let go; empty: it is the operator's.
  std::string obstacle(Time now) const;
  /// The robot has answered the present engagement by following.
  bool is_followed() const { return followed_; }
  /// Why the last engagement was not followed, until one is; else empty. Not an obstacle.
  const std::string& complaint() const { return complaint_; }

 private:
  bool is_silent(const std::optional<Time>& arrival, Time now) const;
  bool is_ours(const ControllerState& report) const;
  std::string missing(Time now) const;
  std::string refusal() const;
  Duration longest_wait() const;

  RobotWatchOptions options_;
  int joint_count_;
  int64_t session_ = 0;
  std::optional<Time> joints_arrival_, report_arrival_, other_arm_arrival_;
  int other_arm_joints_ = 0;
  ControllerState report_;
  std::optional<Duration> round_trip_;
  // Of the present engagement.
  bool engaged_ = false, followed_ = false, lost_ = false;
  Time engaged_at_, engaged_stamp_;
  std::optional<Time> known_to_robot_;  // by the robot's clock
  std::string complaint_;
};

}  // namespace foresight
