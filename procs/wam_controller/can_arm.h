// The WAM on its CAN bus: asks all pucks for their positions, sends torques in packed frames, and
// asks the safety board for its mode.
//
//   CanArm hardware(bus, arm, torque_units_per_nm);
//   if (!hardware.start()) …                      // wakes the pucks
//   hardware.set_zero(counts_at_zero);            // found by home_reference.h
//   if (hardware.read(now, &reading)) hardware.write(torque);
//
// Not yet run on a real arm. A puck counts from where it was switched on, so there are no readings
// before the counts at the joints' zero are known. No allocation, no exceptions.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "common/arm_model.h"
#include "procs/wam_controller/arm_hardware.h"
#include "procs/wam_controller/can_bus.h"
#include "procs/wam_controller/transmission.h"

namespace foresight {

struct CanArmCounts {
  int64_t send_errors = 0;
  int64_t incomplete_reads = 0;  // a puck was silent
  int64_t unknown_frames = 0;
};

class CanArm : public ArmHardware {
 public:
  /// `torque_units_per_nm`: of each motor, the pucks' property IPNM.
  CanArm(CanBus& bus, const ArmModel& arm, const JointVector& torque_units_per_nm);

  /// False when not all pucks answer.
  [[nodiscard]] bool start();
  /// All pucks said at start() that somebody had woken them already: none was switched off since.
  bool had_been_running() const { return running_ == all_motors(); }
  /// Of each motor, as it was read last.
  std::span<const int32_t> position_counts() const {
    return {position_counts_.data(), static_cast<size_t>(transmission_.size())};
  }
  /// From now on read() gives positions.
  void set_zero(std::span<const int32_t> counts_at_zero);
  bool read(Time now, ArmReading* reading) override;
  void write(const JointVector& joint_torque_nm) override;
  const CanArmCounts& counts() const { return counts_; }

 private:
  bool collect_positions();
  void ask_whether_they_run();
  uint32_t all_motors() const { return (1u << transmission_.size()) - 1; }
  void take(const CanFrame& frame);
  bool send(const CanFrame& frame);
  void ask_safety_board();

  CanBus& bus_;
  Transmission transmission_;
  JointVector torque_units_per_nm_;
  std::array<int32_t, kMaxJoints> counts_at_zero_{};
  std::array<int32_t, kMaxJoints> position_counts_{};
  bool has_zero_ = false;
  uint32_t answered_ = 0, running_ = 0;  // one bit per motor
  Safety safety_ = Safety::kEstop;
  int reads_ = 0;
  int board_silence_ = 0;  // questions to the safety board since its last answer
  CanArmCounts counts_;
};

}  // namespace foresight
