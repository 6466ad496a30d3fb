#include "sim/arm/safety_board.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "foresight/pendant_t.hpp"

namespace foresight::sim {
namespace {

constexpr double kTipFromElbow_m = 0.35;

std::string speed_text(const char* what, double speed_m_per_s, double limit_m_per_s) {
  char text[80];
  std::snprintf(text, sizeof text, "%s at %.2f m/s, limit %.2f", what, speed_m_per_s,
                limit_m_per_s);
  return text;
}

}  // namespace

// The elbow is where the fourth joint begins; the forearm is the link after that joint.
ArmSpeeds measure_speeds(const ArmDynamics& dynamics, const JointVector& position_rad,
                         const JointVector& velocity_rad_per_s) {
  const PlacedArm placed = dynamics.place(position_rad);
  const int forearm = std::min(dynamics.size(), 4) - 1;
  const Eigen::Vector3d elbow_in_base =
      forearm > 0 ? Eigen::Vector3d(placed.base_from_link[forearm - 1].translation())
                  : Eigen::Vector3d::Zero();
  const Eigen::Vector3d tip_in_base =
      placed.base_from_link[forearm] * Eigen::Vector3d(0, 0, kTipFromElbow_m);
  const auto speed = [&](int link, const Eigen::Vector3d& point) {
    return dynamics.point_velocity(placed, velocity_rad_per_s, link, point).norm();
  };
  return {speed(forearm, tip_in_base), speed(forearm - 1, elbow_in_base)};
}

SafetyBoard::SafetyBoard(const SafetyLimits& limits, SafetyMode start)
    : limits_(limits), mode_(start) {}

void SafetyBoard::press(int8_t button, Time now) {
  if (button == pendant_t::BUTTON_ESTOP) {
    stop("the E-STOP button was pressed");
  } else if (button == pendant_t::BUTTON_IDLE) {
    go_idle("", now);
  } else if (button == pendant_t::BUTTON_ACTIVATE && mode_ == SafetyMode::kIdle) {
    mode_ = SafetyMode::kActive;
    fault_.clear();
    heart_beats_ = false;
    torques_in_a_row_ = excessive_in_a_row_ = 0;
  }
}

void SafetyBoard::on_torques(const JointVector& motor_torque_nm, Time now) {
  if (mode_ != SafetyMode::kActive) return;
  const bool is_late = now - last_torques_ > limits_.heartbeat;
  torques_in_a_row_ = is_late ? 1 : std::min(torques_in_a_row_ + 1, kTorquesToBegin);
  heart_beats_ = heart_beats_ || torques_in_a_row_ == kTorquesToBegin;
  last_torques_ = now;
  Eigen::Index worst = 0;
  const double excess_nm = (motor_torque_nm.cwiseAbs() - limits_.motor_torque_nm).maxCoeff(&worst);
  excessive_in_a_row_ = excess_nm > 0 ? excessive_in_a_row_ + 1 : 0;
  if (excessive_in_a_row_ < kTorquesToFault) return;
  char text[80];
  std::snprintf(text, sizeof text, "torque of motor %d at %.2f N·m, limit %.2f",
                static_cast<int>(worst) + 1, motor_torque_nm[worst],
                limits_.motor_torque_nm[worst]);
  go_idle(text, now);
}

void SafetyBoard::watch(const ArmSpeeds& speeds, Time now) {
  const bool tip_is_faster = speeds.tip_m_per_s >= speeds.elbow_m_per_s;
  const double speed = std::max(speeds.tip_m_per_s, speeds.elbow_m_per_s);
  const bool too_fast = speed > limits_.fault_speed_m_per_s;
  is_warning_ = speed > limits_.warning_speed_m_per_s;
  const std::string text =
      too_fast ? speed_text(tip_is_faster ? "tip" : "elbow", speed, limits_.fault_speed_m_per_s)
               : "";
  if (mode_ == SafetyMode::kActive) {
    if (too_fast) return go_idle(text, now);
    if (heart_beats_ && now - last_torques_ > limits_.heartbeat) {
      go_idle("the controller sends no torques", now);
    }
  } else if (mode_ == SafetyMode::kIdle && too_fast && now - idle_since_ >= limits_.braking) {
    stop(text + " in spite of braking");
  }
}

void SafetyBoard::pass_over(Duration gap) {
  last_torques_ = last_torques_ + gap;
  idle_since_ = idle_since_ + gap;
}

void SafetyBoard::go_idle(const std::string& fault, Time now) {
  if (mode_ != SafetyMode::kIdle) idle_since_ = now;
  mode_ = SafetyMode::kIdle;
  fault_ = fault;
}

void SafetyBoard::stop(const std::string& fault) {
  mode_ = SafetyMode::kEstop;
  fault_ = fault;
}

}  // namespace foresight::sim
