#include "common/arm_model.h"

#include <algorithm>

namespace foresight {
namespace {

Eigen::Isometry3d turn_and_shift(const ArmJoint& joint, double position_rad) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  Eigen::Isometry3d t = Eigen::Isometry3d::Identity();
  t.rotate(AngleAxisd(position_rad + joint.theta_offset_rad, Vector3d::UnitZ()));
  t.translate(Vector3d(joint.a_m, 0, joint.d_m));
  t.rotate(AngleAxisd(joint.alpha_rad, Vector3d::UnitX()));
  return t;
}

}  // namespace

JointVector ArmModel::home() const {
  JointVector position_rad(size());
  for (int i = 0; i < size(); ++i) position_rad[i] = joints[static_cast<size_t>(i)].home_rad;
  return position_rad;
}

Eigen::Isometry3d ArmModel::base_from_link(const JointVector& position_rad, int index) const {
  Eigen::Isometry3d base_from_link = Eigen::Isometry3d::Identity();
  for (int i = 0; i <= index; ++i) {
    base_from_link =
        base_from_link * turn_and_shift(joints[static_cast<size_t>(i)], position_rad[i]);
  }
  return base_from_link;
}

Pose<Base, Ee> ArmModel::base_from_ee(const JointVector& position_rad) const {
  Eigen::Isometry3d base_from_ee = base_from_link(position_rad, size() - 1);
  base_from_ee.translate(Eigen::Vector3d(0, 0, tool_m));
  return {Eigen::Matrix3d(base_from_ee.linear()), base_from_ee.translation()};
}

Pose<Base, Cam> ArmModel::base_from_cam(const JointVector& position_rad) const {
  return base_from_ee(position_rad) * ee_from_cam;
}

JointVector ArmModel::clamp(const JointVector& position_rad, double margin_rad) const {
  JointVector inside = position_rad;
  for (int i = 0; i < size(); ++i) {
    const ArmJoint& joint = joints[static_cast<size_t>(i)];
    inside[i] = std::clamp(inside[i], joint.lower_rad + margin_rad, joint.upper_rad - margin_rad);
  }
  return inside;
}

}  // namespace foresight
