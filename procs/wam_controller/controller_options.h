// The core's options from the process's parameters.
#pragma once

#include "procs/wam_controller/arm_controller.h"
#include "procs/wam_controller/params.h"

namespace foresight {

ControllerOptions options_of(const WamControllerParams& params);
/// Throws ConfigError when the limits leave a joint no room.
void check_margin(const ArmModel& arm, const WamControllerParams& params);

}  // namespace foresight
