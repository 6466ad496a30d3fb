#include "sim/robot/robot.h"

#include "common/check.h"
#include "foresight/pendant_t.hpp"

namespace foresight::sim {

Robot::Robot(const ArmModel& arm, const RobotParams& params, Time start)
    : plant_(arm, params.plant),
      board_({.motor_torque_nm = plant_.motor_limit_nm(), .heartbeat = params.heartbeat},
             params.start_mode),
      base_(params.base),
      history_(milliseconds(500)),
      heartbeat_(params.heartbeat),
      start_(start),
      now_(start),
      answered_(start),
      motor_torque_nm_(JointVector::Zero(arm.size())) {
  history_.add(now_, plant_.state());
}

void Robot::tick() {
  plant_.step(kTick, motor_torque_nm_, motor_mode(), base_.motion_at((now_ - start_).seconds()));
  now_ = now_ + kTick;
  const ArmState& state = plant_.state();
  history_.add(now_, state);
  board_.watch(measure_speeds(plant_.dynamics(), state.position_rad, state.velocity_rad_per_s),
               now_);
}

void Robot::pass_over(Duration gap) {
  now_ = now_ + gap;
  board_.pass_over(gap);
}

MotorMode Robot::motor_mode() const {
  if (is_on_stand_) return MotorMode::kHeld;
  return board_.is_driven() ? MotorMode::kDriven : MotorMode::kBraking;
}

bool Robot::take_torques(Time reading, const JointVector& motor_torque_nm) {
  FORESIGHT_CHECK(motor_torque_nm.size() == joint_count());
  const bool is_next = answered_ < reading && reading <= now_ && reading >= now_ - heartbeat_;
  if (!is_next || (reading - start_).us % kTick.us != 0) return false;
  answered_ = reading;
  board_.on_torques(motor_torque_nm, now_);
  if (!board_.is_driven()) return true;
  motor_torque_nm_ = motor_torque_nm;
  if (!motor_torque_nm.isZero(0)) is_on_stand_ = false;
  return true;
}

void Robot::press(int8_t pendant_button) {
  board_.press(pendant_button, now_);
  if (!board_.is_driven()) motor_torque_nm_.setZero();
}

RobotTruth Robot::truth_at(Time time) const {
  const Pose<World, Base> world_from_base = base_.at((time - start_).seconds());
  const ArmState arm = history_.at(time);
  const Pose<Base, Cam> base_from_cam = plant_.dynamics().arm().base_from_cam(arm.position_rad);
  return {world_from_base, world_from_base * base_from_cam, arm};
}

}  // namespace foresight::sim
