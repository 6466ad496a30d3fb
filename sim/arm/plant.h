// The arm as its motors feel it: rigid bodies with friction, joint stops, torque limits of the
// motors, and resistive braking (shorted windings) when they are not powered.
//
//   ArmPlant plant(arm, {});
//   plant.step(milliseconds(2), motor_torque_nm, MotorMode::kDriven, base_motion);
//   std::vector<int32_t> counts = ...; plant.read_encoders(counts);
//
// Integrated in substeps of at most 0.5 ms: half a step of position, a whole one of velocity, half
// a step of position; what damps (friction, stops, braking) enters the velocity implicitly, so that
// light wrist joints and hard stops stay stable. No allocation, no exceptions.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "common/arm_model.h"
#include "common/time.h"
#include "sim/arm/dynamics.h"

namespace foresight::sim {

struct PlantParams {
  // Friction of a joint, as shares of the torque that its controller may ask for.
  double coulomb_share = 0.04;
  double viscous_share_s = 0.02;          // per rad/s
  double coulomb_width_rad_per_s = 0.02;  // Coulomb friction sets in over this velocity
  double motor_limit_share = 1.5;         // of the motor torque that the joints' limits need
  double braking_nm_s = 0.04;             // of a shorted motor, per rad/s of the motor
  double stop_stiffness_per_rad = 500;    // of joint stops, in torque limits per rad
  double stop_damping_s = 0.02;           // of joint stops, in stiffnesses
};

struct ArmState {
  JointVector position_rad, velocity_rad_per_s;
};

enum class MotorMode : uint8_t {
  kDriven,   // torques as commanded
  kBraking,  // resistive braking
  kHeld,     // a stand carries the arm: it does not move
};

class ArmPlant {
 public:
  /// Begins at home, at rest.
  ArmPlant(const ArmModel& arm, const PlantParams& params);

  void step(Duration duration, const JointVector& motor_torque_nm, MotorMode mode,
            const BaseMotion& base);

  const ArmState& state() const { return state_; }
  void set_state(const ArmState& state) { state_ = state; }
  const ArmDynamics& dynamics() const { return dynamics_; }
  /// The most that each motor can give.
  const JointVector& motor_limit_nm() const { return motor_limit_nm_; }
  /// Motor positions in whole counts, one per motor.
  void read_encoders(std::span<int32_t> counts) const;

 private:
  // What acts on the joints at a velocity v: push − drag · v.
  struct Forces {
    JointVector push_nm;
    JointMatrix drag_nm_s;
  };
  void substep(double dt_s, const JointVector& joint_torque_nm, MotorMode mode,
               const BaseMotion& base);
  void add_friction(Forces& forces) const;
  void add_stops(double dt_s, Forces& forces) const;

  ArmDynamics dynamics_;
  PlantParams params_;
  JointVector torque_limit_nm_, motor_limit_nm_;
  JointMatrix braking_nm_s_;
  ArmState state_;
};

}  // namespace foresight::sim
