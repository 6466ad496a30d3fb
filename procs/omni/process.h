#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "common/clock_offset.h"
#include "common/node.h"
#include "common/process_main.h"
#include "foresight/controller_state_t.hpp"
#include "foresight/device_state_t.hpp"
#include "foresight/joint_command_t.hpp"
#include "foresight/joint_state_t.hpp"
#include "procs/omni/clutch.h"
#include "procs/omni/command_session.h"
#include "procs/omni/device_config.h"
#include "procs/omni/input_device.h"
#include "procs/omni/joint_commander.h"
#include "procs/omni/params.h"
#include "procs/omni/rival_watch.h"
#include "procs/omni/robot_watch.h"
#include "procs/omni/steady_time.h"

namespace foresight {

/// Reads the operator's device and publishes DEVICE_STATE and JOINT_COMMAND (paper §II-D).
class OmniProcess : public Process {
 public:
  using Params = OmniParams;
  using DeviceMaker = std::function<std::unique_ptr<InputDevice>(const OmniParams&, const ArmModel&,
                                                                 const JointMapping&)>;
  static constexpr ProcessInfo kInfo{
      "omni", "Reads the operator's device and publishes joint commands.", Domain::kOperator};

  /// `make`: tests give devices of their own.
  OmniProcess(Node& node, const OmniParams& params, DeviceMaker make = make_device);
  void start() override;

 private:
  void on_joint_state(const joint_state_t& message);
  void on_controller_state(const controller_state_t& message);
  void on_tick();
  std::string find_obstacle(Time now, Time steady);
  bool heed_clutch(const DeviceReading& reading, const std::string& obstacle);
  void publish_device(Time now, const DeviceReading& reading);
  void publish_command(Time now, Time steady);
  void set_metrics();
  void report(const DeviceReading& reading, const std::string& obstacle);
  std::string find_trouble(const DeviceReading& reading, const std::string& obstacle) const;

  Node& node_;
  OmniParams params_;
  DeviceMaker make_;
  Input joint_state_input_;
  Publisher<device_state_t> states_;
  Publisher<joint_command_t> commands_;
  std::unique_ptr<InputDevice> device_;
  std::optional<JointCommander> commander_;
  std::optional<RobotWatch> robot_;
  ClockOffset clocks_;
  SteadyTime steady_;  // of arrivals and of the device: the clock may be set back
  std::optional<Time> last_tick_;
  RivalWatch rivals_;
  Clutch clutch_;
  CommandSession session_;
  // Why the clutch has to be let go and pressed again.
  std::string let_go_because_ = "it was held when omni started";
  std::string description_;  // of the device, as it was last said
  int engagements_ = 0;
};

}  // namespace foresight
