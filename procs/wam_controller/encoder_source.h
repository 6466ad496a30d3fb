// The simulated arm: messages ARM_ENCODERS in, ARM_TORQUES out.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "common/node.h"
#include "foresight/arm_encoders_t.hpp"
#include "foresight/arm_torques_t.hpp"
#include "procs/wam_controller/arm_hardware.h"
#include "procs/wam_controller/transmission.h"

namespace foresight {

class EncoderSource : public ArmHardware {
 public:
  /// `on_reading` is called for every message that passed; read() then has it.
  EncoderSource(Node& node, std::function<void()> on_reading);

  /// Messages are refused until the arm is known, and when they are older than `max_age`.
  void start(const ArmModel& arm, Duration max_age);
  bool read(Time now, ArmReading* reading) override;
  void write(const JointVector& joint_torque_nm) override;

 private:
  void on_encoders(const arm_encoders_t& message);
  const char* find_error(const arm_encoders_t& message) const;

  Node& node_;
  std::function<void()> on_reading_;
  Input input_;
  Publisher<arm_torques_t> torques_;
  std::optional<Transmission> transmission_;
  Duration max_age_{0};
  arm_encoders_t encoders_{};
  arm_torques_t answer_{};
  bool is_new_ = false;
};

}  // namespace foresight
