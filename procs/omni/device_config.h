// From parameters and files to a device and its mapping.
#pragma once

#include <memory>
#include <string>

#include "common/arm_model.h"
#include "procs/omni/input_device.h"
#include "procs/omni/joint_mapping.h"
#include "procs/omni/params.h"

namespace foresight {

/// Reads a mapping (deploy/mappings/*.yaml). Throws ConfigError.
JointMapping load_mapping_file(const std::string& path, const ArmModel& arm);

/// The mapping that the parameters name. Throws ConfigError.
JointMapping choose_mapping(const OmniParams& params, const ArmModel& arm);

/// The device that the parameters name, not yet opened. Throws ConfigError.
std::unique_ptr<InputDevice> make_device(const OmniParams& params, const ArmModel& arm,
                                         const JointMapping& mapping);

}  // namespace foresight
