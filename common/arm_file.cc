#include "common/arm_model.h"
#include "common/errors.h"
#include "common/yaml_reader.h"

namespace foresight {
namespace {

ArmJoint read_joint(YamlReader& in) {
  ArmJoint joint;
  joint.a_m = in.number("a_m", -5, 5);
  joint.alpha_rad = in.number("alpha_rad", -3.2, 3.2);
  joint.d_m = in.number("d_m", -5, 5);
  joint.theta_offset_rad = in.number_or("theta_offset_rad", 0, -6.3, 6.3);
  const auto limits = in.numbers("limits_rad", 2, -6.3, 6.3);
  joint.lower_rad = limits[0];
  joint.upper_rad = limits[1];
  if (joint.lower_rad >= joint.upper_rad) in.refuse("limits_rad", "lower is not below upper");
  joint.home_rad = in.number("home_rad", joint.lower_rad, joint.upper_rad);
  joint.torque_limit_nm = in.number("torque_limit_nm", 0, 1e4);
  const auto pid = in.numbers("pid", 3, 0, 1e6);
  joint.kp = pid[0];
  joint.ki = pid[1];
  joint.kd = pid[2];
  return joint;
}

ArmLink read_link(YamlReader& in) {
  ArmLink link;
  link.mass_kg = in.number("mass_kg", 0, 1e3);
  link.centre_of_mass_m = Eigen::Vector3d(in.numbers("centre_of_mass_m", 3, -5, 5).data());
  const auto i = in.numbers("inertia_kg_m2", 6, -1e3, 1e3);  // xx yy zz xy xz yz
  link.inertia_kg_m2 << i[0], i[3], i[4], i[3], i[1], i[5], i[4], i[5], i[2];
  return link;
}

Pose<Ee, Cam> read_camera(YamlReader in) {
  const auto q = in.numbers("quat_wxyz", 4, -1, 1);
  const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  if (std::abs(rotation.norm() - 1) > 1e-3) in.refuse("quat_wxyz", "is not of length 1");
  const Eigen::Vector3d position(in.numbers("position_m", 3, -5, 5).data());
  in.refuse_leftovers();
  return {rotation, position};
}

void read_transmission(YamlReader in, ArmModel& arm) {
  const int n = arm.size();
  const auto count = static_cast<size_t>(n);
  const auto entries = in.numbers("motor_from_joint", count * count, -1e4, 1e4);
  arm.motor_from_joint.resize(n, n);
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      arm.motor_from_joint(row, column) = entries[static_cast<size_t>(row * n + column)];
    }
  }
  if (std::abs(arm.motor_from_joint.determinant()) < 1e-9) {
    in.refuse("motor_from_joint", "cannot be inverted");
  }
  arm.rotor_inertia_kg_m2 =
      JointVector::Map(in.numbers("rotor_inertia_kg_m2", count, 0, 1).data(), n);
  arm.counts_per_revolution = in.number("counts_per_revolution", 1, 1e9);
  in.refuse_leftovers();
}

}  // namespace

ArmModel load_arm_file(const std::string& path) {
  YamlReader in = YamlReader::open(path);
  ArmModel arm;
  arm.name = in.text("name");
  for (YamlReader& joint : in.list("joints", 1, kMaxJoints)) {
    arm.joints.push_back(read_joint(joint));
    joint.refuse_leftovers();
  }
  for (YamlReader& link : in.list("links", arm.joints.size(), arm.joints.size())) {
    arm.links.push_back(read_link(link));
    link.refuse_leftovers();
  }
  arm.tool_m = in.number("tool_m", -5, 5);
  arm.ee_from_cam = read_camera(in.map("ee_from_cam"));
  read_transmission(in.map("transmission"), arm);
  in.refuse_leftovers();
  return arm;
}

}  // namespace foresight
