// An arm of two joints and the controller that moves it, for tests of who predicts it.
#pragma once

#include <deque>
#include <set>
#include <utility>

#include "procs/renderer/camera_predictor.h"

namespace foresight {

constexpr Time kStart{1'000'000'000};
constexpr Duration kCommandPeriod = microseconds(33'333);

// Two joints in a plane are enough: what is predicted does not depend on the arm's shape.
inline ArmModel two_joints() {
  ArmModel arm;
  for (int i = 0; i < 2; ++i) {
    ArmJoint joint;
    joint.a_m = 0.5;
    joint.lower_rad = -2;
    joint.upper_rad = 2;
    arm.joints.push_back(joint);
  }
  return arm;
}

// The robot's side: commands arrive after a delay, the reference follows those of the sender that
// drives, and the operator's side sees its state after another. It is what wam_controller's README
// says, written anew.
class Robot {
 public:
  explicit Robot(const ControllerLimits& limits) : limits_(limits), reference_(limits.motion) {
    reference_.rest(kStart, JointVector::Zero(2));
  }
  // The loop as wam_controller runs it, every 2 ms.
  void run_until(Time time) {
    for (; now_ <= time; now_ = now_ + milliseconds(2)) {
      while (!arriving_.empty() && arriving_.front().second <= now_) {
        accept(arriving_.front().first);
        arriving_.pop_front();
      }
      if (driver_ != 0 && now_ - driven_ > limits_.command_timeout) {
        released_.erase(driver_);
        let_go();
      }
    }
  }
  void send(const JointCommand& command, Time arrival) { arriving_.push_back({command, arrival}); }
  JointState state() const {
    const Time t = now_ - milliseconds(2);
    const JointMotion motion = reference_.at(t);
    return {.time = t,
            .position_rad = motion.position_rad,
            .velocity_rad_per_s = motion.velocity_rad_per_s,
            .reference_rad = motion.position_rad,
            .reference_velocity_rad_per_s = motion.velocity_rad_per_s,
            .target_rad = reference_.target_rad(),
            .command_time = command_time_,
            .command_arrival = arrival_};
  }
  ControllerState controller() const {
    return {.time = now_ - milliseconds(2),
            .state = driver_ != 0 ? ArmState::kFollowing : ArmState::kHolding,
            .driver_session = driver_,
            .needs_release = driver_ == 0 && released_.empty(),
            .limits = limits_};
  }
  // Power comes and goes: everybody must let go before he drives.
  void revoke() {
    released_.clear();
    let_go();
  }
  int64_t driver() const { return driver_; }

 private:
  void accept(const JointCommand& command) {
    if (!command.is_engaged) released_.insert(command.session);
    if (command.is_engaged && driver_ != command.session) {
      if (driver_ == 0 && released_.contains(command.session)) driver_ = command.session;
      released_.erase(command.session);
      if (driver_ != command.session) return;
    }
    command_time_ = command.time;
    arrival_ = now_;
    if (driver_ != command.session) return;
    if (!command.is_engaged) return let_go();
    driven_ = now_;
    reference_.follow(now_, two_joints().clamp(command.position_rad, limits_.joint_margin_rad));
  }
  void let_go() {
    driver_ = 0;
    reference_.stop(now_);
  }
  ControllerLimits limits_;
  JointReference reference_;
  std::deque<std::pair<JointCommand, Time>> arriving_;
  std::set<int64_t> released_;
  int64_t driver_ = 0;
  Time now_ = kStart, command_time_, arrival_, driven_;
};

}  // namespace foresight
