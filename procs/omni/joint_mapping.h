// From the axes of an input device to the joints of an arm (paper §II-D, Fig. 5): each joint
// follows one axis with a scale and an offset, or is held.
//
//   const JointMapping mapping = paper_mapping();
//   JointVector arm_rad = map_positions(mapping, arm, device_rad);
//
// Pure arithmetic; limits and the clutch are the business of joint_commander.h.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/arm_model.h"

namespace foresight {

/// Where one joint of the arm comes from.
struct JointSource {
  int axis = 0;      // of the device, counted from 1; 0: the joint is held
  double scale = 1;  // rad per rad of the axis; of a deflection: share of the full velocity
  /// Added to the scaled axis (nothing: 0). Of a held joint: where (nothing: at the arm's home).
  std::optional<double> offset_rad = std::nullopt;
};

struct JointMapping {
  /// 1 or −1 per device axis, applied first: turns the device's sense into that of the mapping.
  /// Axes beyond the list have 1.
  std::vector<double> axis_signs;
  /// Of the arm's joints in order; joints beyond the list are held at home.
  std::vector<JointSource> joints;

  double sign(int axis) const;
  /// The highest axis in use: how many a device must have.
  int axes_needed() const;
  /// One line for people: "joint 1: axis 1 x -1, joint 2: …".
  std::string description() const;
};

/// θ_WAM = [θ1, −9/5·θ2 − π/2, 0, π/2 − θ3]. The device library counts the Omni's second joint in
/// the other sense than the paper (0…1.75 rad upwards), hence its sign −1: so the WAM's second
/// joint spans −1.57…1.58 rad; without it −1.57…−4.72 (limit ±2.0).
JointMapping paper_mapping();
/// Left stick: joints 1 and 2; right stick, forth and back: joint 4 (order of Linux' xpad driver).
JointMapping gamepad_mapping();
/// One axis per pair of keys, see key_decoder.h.
JointMapping keyboard_mapping();
/// Twist: joint 1; push: joint 2; lift: joint 4.
JointMapping spacemouse_mapping();

/// Positions of all of the arm's joints. `axes_rad` has at least axes_needed() numbers. Not
/// limited.
JointVector map_positions(const JointMapping& mapping, const ArmModel& arm,
                          std::span<const double> axes_rad);
/// Velocities of all of the arm's joints as shares of the full one; held joints stand still.
JointVector map_deflections(const JointMapping& mapping, const ArmModel& arm,
                            std::span<const double> deflections);

}  // namespace foresight
