#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "common/node.h"
#include "common/process_main.h"
#include "foresight/device_state_t.hpp"
#include "foresight/joint_command_t.hpp"
#include "foresight/joint_state_t.hpp"
#include "procs/omni/clutch.h"
#include "procs/omni/device_config.h"
#include "procs/omni/input_device.h"
#include "procs/omni/joint_commander.h"
#include "procs/omni/params.h"

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
  void on_joint_state(const joint_state_t& state);
  void on_tick();
  void publish_device(Time now, const DeviceReading& reading);
  void publish_command(Time now);
  void report(const DeviceReading& reading);

  Node& node_;
  OmniParams params_;
  DeviceMaker make_;
  Publisher<device_state_t> states_;
  Publisher<joint_command_t> commands_;
  std::unique_ptr<InputDevice> device_;
  std::optional<JointCommander> commander_;
  Clutch clutch_;
  int64_t session_ = 0, seq_ = 0;
  int engagements_ = 0;
};

}  // namespace foresight
