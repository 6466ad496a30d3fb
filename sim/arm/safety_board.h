// The arm's safety board: watches the speed of tip and elbow, the torques asked of the motors, and
// the controller's heartbeat; cuts the motors (IDLE: resistive braking, or E-STOP) and lets only a
// person switch them on again.
//
//   SafetyBoard board(limits, SafetyMode::kIdle);
//   board.press(pendant_t::BUTTON_ACTIVATE, now);       // a person
//   board.on_torques(torque_nm, now);                   // whenever the controller sends some
//   board.watch({.tip_m_per_s = 0.2, .elbow_m_per_s = 0.1}, now);   // every tick
//   if (board.mode() == SafetyMode::kActive) …
//
//   E-STOP ──press idle──► IDLE ──press activate──► ACTIVE
//     ▲ press e-stop, or     ▲ press idle, or a fault  │
//     └─ too fast 0.5 s after └────────────────────────┘
//
// Behaviour and limits are those of the WAM's board (manufacturer's manual), but that torques come
// as messages here, which anybody may send: one odd one out must not stop the arm. So the
// controller counts as begun after kTorquesToBegin in a row, and too much torque is a fault when it
// is asked for kTorquesToFault times in a row (the motors give their limit meanwhile). No
// allocation but for the text of a fault, no exceptions.
#pragma once

#include <cstdint>
#include <string>

#include "common/arm_model.h"
#include "common/time.h"
#include "sim/arm/dynamics.h"

namespace foresight::sim {

enum class SafetyMode : int8_t { kEstop = 0, kIdle = 1, kActive = 2 };  // as in arm_encoders_t

struct SafetyLimits {
  double warning_speed_m_per_s = 0.5;
  double fault_speed_m_per_s = 1.0;
  JointVector motor_torque_nm;            // more than this asked of a motor is a fault
  Duration heartbeat = milliseconds(50);  // longest silence of the controller
  Duration braking = milliseconds(500);   // in IDLE, until the arm must have slowed down
};

/// Speeds relative to the base.
struct ArmSpeeds {
  double tip_m_per_s = 0;  // of the point 350 mm from the elbow along the forearm
  double elbow_m_per_s = 0;
};
ArmSpeeds measure_speeds(const ArmDynamics& dynamics, const JointVector& position_rad,
                         const JointVector& velocity_rad_per_s);

constexpr int kTorquesToBegin = 3;
constexpr int kTorquesToFault = 3;

class SafetyBoard {
 public:
  SafetyBoard(const SafetyLimits& limits, SafetyMode start);

  /// A button of pendant_t; others do nothing.
  void press(int8_t button, Time now);
  /// Torques asked of the motors; the heartbeat is watched once the controller has begun.
  void on_torques(const JointVector& motor_torque_nm, Time now);
  void watch(const ArmSpeeds& speeds, Time now);

  /// A stretch of time in which nothing was watched: the heartbeat is not missed in it.
  void pass_over(Duration gap);

  SafetyMode mode() const { return mode_; }
  /// The controller drives the motors: active, and it has begun since.
  bool is_driven() const { return mode_ == SafetyMode::kActive && heart_beats_; }
  bool is_warning() const { return is_warning_; }
  /// Why it left ACTIVE; empty while there is no fault.
  const std::string& fault() const { return fault_; }

 private:
  void go_idle(const std::string& fault, Time now);
  void stop(const std::string& fault);

  SafetyLimits limits_;
  SafetyMode mode_;
  std::string fault_;
  bool is_warning_ = false;
  bool heart_beats_ = false;    // the controller has begun since activation
  int torques_in_a_row_ = 0;    // until it has
  int excessive_in_a_row_ = 0;  // torques above a motor's limit
  Time last_torques_, idle_since_;
};

}  // namespace foresight::sim
