// What is said of the robot, as values: commands, joints, the controller's state, the alignment,
// the base. One type per fact for every core that works with it; common/robot_messages.h turns
// messages into these and back.
//
//   if (const auto state = read_joint_state(message)) predictor.set_joint_state(now, *state);
//
// Positions are in rad or m; times are stamps of the host that took them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "common/arm_model.h"
#include "common/frames.h"
#include "common/time.h"
#include "common/trapezoid.h"

namespace foresight {

/// Where the operator wants the joints (joint_command_t).
struct JointCommand {
  Time time = {};            // when his device was read
  int64_t session = 0;       // of the sender: when it started, µs; above 0
  int64_t seq = 0;           // within the session
  bool is_engaged = false;   // dead-man switch
  JointVector position_rad;  // empty when the message has no joints, or more than any arm
};

/// The arm as measured, and where its controller wants it (joint_state_t).
struct JointState {
  Time time = {};  // of the encoder reading
  JointVector position_rad, velocity_rad_per_s;
  JointVector reference_rad, reference_velocity_rad_per_s, target_rad;
  Time command_time = {}, command_arrival = {};  // of the newest command dealt with; 0: none yet
};

/// What the arm's controller does; the numbers of controller_state_t.
enum class ArmState : int8_t { kIdle = 0, kHolding, kFollowing, kStopping, kFault };

/// What the arm's controller works with; these and no others give its motion.
struct ControllerLimits {
  MotionLimits motion = {};
  double joint_margin_rad = 0.05;                // targets stay this far inside the joint limits
  Duration command_timeout = milliseconds(500);  // the driver's lease
  bool operator==(const ControllerLimits&) const = default;
};

/// What the controller says of itself (controller_state_t), as far as others act on it.
struct ControllerState {
  Time time = {};
  ArmState state = ArmState::kIdle;  // as received: a newer controller may know more of them
  std::string reason = {};           // for people
  int64_t driver_session = 0;        // whose commands it follows; 0: nobody's
  bool needs_release = false;        // nobody could drive by engaging
  int64_t commands_of_others = 0;    // dropped, since its start
  ControllerLimits limits = {};      // not above 0: it does not say
};

/// How the map lies in the robot's world (alignment_t that says ALIGNED).
struct Alignment {
  int64_t epoch = 0;
  Similarity<World, Map> world_from_map;
  Pose<Ee, Cam> ee_from_cam;
  double joint_delay_s = 0;  // an image of time t shows the joints of t + joint_delay_s
};

enum class BaseTracking : uint8_t {
  kMeasured,  // this frame contributed
  kCoasting,  // predicted
};

/// Where the base is, and how it moves (base_pose_t).
struct BaseState {
  Time time = {};  // of the frame
  int64_t epoch = 0;
  Pose<World, Base> world_from_base;
  Eigen::Vector3d velocity_m_per_s = Eigen::Vector3d::Zero();            // in world axes
  Eigen::Vector3d angular_velocity_rad_per_s = Eigen::Vector3d::Zero();  // in world axes
  BaseTracking tracking = BaseTracking::kCoasting;
  double position_sigma_m = 0;    // 3D
  double rotation_sigma_rad = 0;  // 3D
};

}  // namespace foresight
