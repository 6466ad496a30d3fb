#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/node.h"
#include "common/process_main.h"
#include "foresight/controller_state_t.hpp"
#include "foresight/joint_command_t.hpp"
#include "foresight/joint_state_t.hpp"
#include "procs/wam_controller/arm_controller.h"
#include "procs/wam_controller/can_start.h"
#include "procs/wam_controller/command_watch.h"
#include "procs/wam_controller/encoder_source.h"
#include "procs/wam_controller/params.h"
#include "procs/wam_controller/period_jitter.h"

namespace foresight {

/// Makes the arm's joints follow the operator's commands along trapezoids (§II-D).
class WamControllerProcess : public Process {
 public:
  using Params = WamControllerParams;
  static constexpr ProcessInfo kInfo{
      "wam_controller", "Moves the arm's joints smoothly to where the operator commands them.",
      Domain::kRobot};

  WamControllerProcess(Node& node, const WamControllerParams& params);
  void start() override;

 private:
  void keep_home();
  void start_realtime();
  void on_command(const joint_command_t& message);
  void on_timer();
  void look_at_clock();
  void step();
  void report_change();
  void publish_state();
  void publish_joints();
  void report_health();
  void set_metrics();
  std::string reason() const;
  int64_t malformed_commands() const;

  Node& node_;
  WamControllerParams params_;
  Publisher<joint_state_t> joint_states_;
  Publisher<controller_state_t> states_;
  std::optional<ArmController> controller_;  // from start() on
  std::unique_ptr<EncoderSource> messages_;
  std::optional<StartedCanArm> can_;
  ArmHardware* hardware_ = nullptr;
  PeriodJitter jitter_;
  CommandWatch watch_;
  int64_t clock_changes_ = 0;
  struct Reported {
    ArmStatus status;
    int64_t driver_session = 0;
    bool needs_release = true;
    bool operator==(const Reported&) const = default;
  };
  Reported present() const;
  Reported reported_;
  std::string board_fault_;  // the safety board's own words
  bool is_warning_ = false, has_realtime_ = true;
  double largest_error_rad_ = 0;  // since the last timer
  Time joint_state_due_;
};

}  // namespace foresight
