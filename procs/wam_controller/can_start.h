// Starts the arm on its CAN bus: checks the parameters, wakes the motor controllers, finds where
// their counts have their zero, and keeps that in a file for the next start.
//
//   StartedCanArm can = start_can_arm(params, arm, now);       // throws StartupError
//   keep_home_reference(params, can.home);                     // now and then, beside the main
//   thread
#pragma once

#include <memory>

#include "procs/wam_controller/can_arm.h"
#include "procs/wam_controller/home_reference.h"
#include "procs/wam_controller/params.h"

namespace foresight {

struct StartedCanArm {
  std::unique_ptr<CanBus> bus;
  std::unique_ptr<CanArm> arm;
  HomeReference home;
};
StartedCanArm start_can_arm(const WamControllerParams& params, const ArmModel& arm, Time now);
/// The same on a bus that is open already.
StartedCanArm start_can_arm(const WamControllerParams& params, const ArmModel& arm, Time now,
                            std::unique_ptr<CanBus> bus);

/// False when the file cannot be written; what was in it is then still there.
[[nodiscard]] bool keep_home_reference(const std::string& path, const HomeReference& home);

}  // namespace foresight
