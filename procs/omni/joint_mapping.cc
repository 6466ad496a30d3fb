#include "procs/omni/joint_mapping.h"

#include <algorithm>
#include <numbers>
#include <sstream>

namespace foresight {

double JointMapping::sign(int axis) const {
  const auto index = static_cast<size_t>(axis - 1);
  return index < axis_signs.size() ? axis_signs[index] : 1;
}

int JointMapping::axes_needed() const {
  int needed = 0;
  for (const JointSource& joint : joints) needed = std::max(needed, joint.axis);
  return needed;
}

std::string JointMapping::description() const {
  std::ostringstream line;
  for (size_t i = 0; i < joints.size(); ++i) {
    if (joints[i].axis == 0) continue;
    line << (line.tellp() > 0 ? ", joint " : "joint ") << i + 1 << ": axis " << joints[i].axis;
    const double factor = joints[i].scale * sign(joints[i].axis);
    if (factor != 1) line << " x " << factor;
  }
  return line.str();
}

JointMapping paper_mapping() {
  constexpr double kQuarterTurn_rad = std::numbers::pi / 2;
  return {.axis_signs = {1, -1, 1, 1, 1, 1},
          .joints = {{.axis = 1, .scale = 1, .offset_rad = 0},
                     {.axis = 2, .scale = -9.0 / 5.0, .offset_rad = -kQuarterTurn_rad},
                     {.offset_rad = 0},
                     {.axis = 3, .scale = -1, .offset_rad = kQuarterTurn_rad}}};
}

JointMapping gamepad_mapping() {
  return {.axis_signs = {},
          .joints = {{.axis = 1, .scale = -1}, {.axis = 2, .scale = -1}, {}, {.axis = 5}}};
}

JointMapping keyboard_mapping() {
  return {.axis_signs = {},
          .joints = {{.axis = 1},
                     {.axis = 2},
                     {.axis = 4},
                     {.axis = 3, .scale = -1},
                     {.axis = 5},
                     {.axis = 6},
                     {.axis = 7}}};
}

JointMapping spacemouse_mapping() {
  return {.axis_signs = {},
          .joints = {{.axis = 5}, {.axis = 3, .scale = -1}, {}, {.axis = 2, .scale = -1}}};
}

JointVector map_positions(const JointMapping& mapping, const ArmModel& arm,
                          std::span<const double> axes_rad) {
  JointVector position_rad = arm.home();
  const size_t count = std::min(mapping.joints.size(), arm.joints.size());
  for (size_t i = 0; i < count; ++i) {
    const JointSource& joint = mapping.joints[i];
    double& target_rad = position_rad[static_cast<Eigen::Index>(i)];
    if (joint.axis == 0) {
      target_rad = joint.offset_rad.value_or(target_rad);
    } else {
      const double axis_rad =
          mapping.sign(joint.axis) * axes_rad[static_cast<size_t>(joint.axis) - 1];
      target_rad = joint.scale * axis_rad + joint.offset_rad.value_or(0);
    }
  }
  return position_rad;
}

JointVector map_deflections(const JointMapping& mapping, const ArmModel& arm,
                            std::span<const double> deflections) {
  JointVector velocity = JointVector::Zero(arm.size());
  const size_t count = std::min(mapping.joints.size(), arm.joints.size());
  for (size_t i = 0; i < count; ++i) {
    const JointSource& joint = mapping.joints[i];
    if (joint.axis == 0) continue;
    velocity[static_cast<Eigen::Index>(i)] =
        joint.scale * mapping.sign(joint.axis) * deflections[static_cast<size_t>(joint.axis) - 1];
  }
  return velocity;
}

}  // namespace foresight
