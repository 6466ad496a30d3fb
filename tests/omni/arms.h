// Arms and readings that the tests share.
#pragma once

#include <string>

#include "common/arm_model.h"
#include "procs/omni/input_device.h"

namespace foresight {

inline std::string deploy_file(const std::string& name) {
  return std::string(FORESIGHT_DEPLOY) + "/" + name;
}
inline ArmModel wam4() { return load_arm_file(deploy_file("arms/wam4.yaml")); }
inline ArmModel wam7() { return load_arm_file(deploy_file("arms/wam7.yaml")); }

/// Of an Omni at these joints, its clutch held.
inline DeviceReading positions(std::vector<double> axes) {
  DeviceReading reading{.connected = true, .engaged = true};
  reading.axes = std::move(axes);
  return reading;
}
/// Of sticks at these deflections, the clutch held.
inline DeviceReading deflections(std::vector<double> axes) {
  DeviceReading reading = positions(std::move(axes));
  reading.kind = AxisKind::kVelocity;
  return reading;
}

}  // namespace foresight
