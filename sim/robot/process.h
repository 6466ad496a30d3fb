#pragma once

#include <memory>
#include <vector>

#include "common/node.h"
#include "common/process_main.h"
#include "foresight/arm_encoders_t.hpp"
#include "foresight/arm_torques_t.hpp"
#include "foresight/pendant_t.hpp"
#include "foresight/sim_clock_t.hpp"
#include "foresight/truth_t.hpp"
#include "sim/robot/pacer.h"
#include "sim/robot/params.h"
#include "sim/robot/photographer.h"
#include "sim/robot/robot.h"

namespace foresight::sim {

/// Stands in for the robot's hardware: arm and safety board, moving base, camera in the hand. It
/// speaks the hardware's messages; the truth goes to channels of its own.
class SimProcess : public Process {
 public:
  using Params = SimParams;
  static constexpr ProcessInfo kInfo{
      "sim", "Simulates the arm, its safety board and camera, and a base that moves.",
      Domain::kRobot};

  SimProcess(Node& node, const SimParams& params);
  void start() override;

 private:
  void follow_host_clock();
  void run_at_own_pace();
  void tick();
  void publish_encoders();
  void on_torques(const arm_torques_t& message);
  void report();
  void report_state();

  Node& node_;
  SimParams params_;
  bool has_own_clock_;
  Input torque_input_;
  Publisher<arm_encoders_t> encoders_;
  Publisher<truth_t> truths_;
  std::vector<Publisher<sim_clock_t>> clocks_;  // none on the host's clock
  Pacer pacer_;
  std::unique_ptr<Photographer> photographer_;  // none without a camera
  std::unique_ptr<Robot> robot_;                // since start()
  int64_t ticks_ = 0, lost_ticks_ = 0, truth_every_ = 0;
  int64_t refused_torques_ = 0;
  Duration tick_time_{0};
  // Of the last report.
  Time reported_at_, robot_then_;
  int64_t ticks_then_ = 0, lost_then_ = 0, skipped_then_ = 0, refused_then_ = 0;
};

}  // namespace foresight::sim
