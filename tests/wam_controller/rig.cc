#include "tests/wam_controller/rig.h"

#include <algorithm>
#include <cmath>

namespace foresight {
namespace {

template <class Message>
void collect(Simulation& world, const char* channel, std::vector<Message>* all) {
  world.listen(Domain::kRobot, channel, [all](auto bytes) {
    Message message{};
    ASSERT_GT(message.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
    all->push_back(message);
  });
}

}  // namespace

WamControllerParams Rig::params_of(const std::string& arm) {
  WamControllerParams params;
  params.arm_file = kArms + "/" + arm + ".yaml";
  return params;
}

Rig::Rig(const WamControllerParams& params)
    : arm(load_arm_file(params.arm_file)),
      plant(arm),
      home_error_rad(JointVector::Zero(arm.size())),
      session(world.now().us),
      params_(params),
      transmission_(arm) {
  add_process();
  collect(world, "CONTROLLER_STATE", &states);
  collect(world, "HEALTH", &healths);
  collect(world, "JOINT_STATE", &joint_states);
  collect(world, "ARM_TORQUES", &torques);
}

void Rig::add_process() {
  world.add("wam_controller", {Domain::kRobot},
            [&](Node& node) { return std::make_unique<WamControllerProcess>(node, params_); });
}

void Rig::restart() {
  world.remove("wam_controller");
  add_process();
}

arm_encoders_t Rig::make_encoders() const {
  const JointVector counts = transmission_.motor_counts(plant.position + home_error_rad);
  arm_encoders_t m{};
  m.utime = world.now().us;
  m.n_motors = arm.size();
  for (int i = 0; i < arm.size(); ++i) {
    m.motor_counts.push_back(static_cast<int32_t>(std::lround(counts[i])));
  }
  m.motor_counts[0] += counts_added;
  m.safety = safety;
  m.fault = fault;
  return m;
}

void Rig::send_encoders(arm_encoders_t message) {
  world.inject(world.now(), Domain::kRobot, "ARM_ENCODERS", encode(message));
}

void Rig::start_arm() {
  world.call_at(world.now(), [this] { tick(); });
}

// 2 ms under the last torques, then the encoders.
void Rig::tick() {
  const bool obeys = safety == arm_encoders_t::SAFETY_ACTIVE && !is_blocked && !torques.empty();
  if (obeys) {
    const auto& motor = torques.back().motor_torque_nm;
    const JointVector motor_nm = JointVector::Map(motor.data(), arm.size());
    plant.move(arm.motor_from_joint.transpose() * motor_nm, 0.002);
  } else {
    plant.brake();
  }
  if (!is_silent) send_encoders(make_encoders());
  world.call_at(world.now() + milliseconds(2), [this] { tick(); });
}

joint_command_t Rig::make_command(const JointVector& target, bool engaged) {
  joint_command_t m{};
  m.utime = world.now().us;
  m.session = session;
  m.seq = seq++;
  m.engaged = engaged ? 1 : 0;
  m.position_rad = {target.data(), target.data() + target.size()};
  m.n_joints = static_cast<int32_t>(target.size());
  return m;
}

void Rig::send(const joint_command_t& message) {
  world.inject(world.now(), Domain::kRobot, "JOINT_COMMAND", encode(message));
}

void Rig::command_for(Duration duration, const std::function<JointVector(int)>& target) {
  const Time end = world.now() + duration;
  for (int i = 0; world.now() < end; ++i) {
    send(make_command(target(i)));
    run(std::min(end - world.now(), microseconds(33'333)));
  }
}

bool Rig::was_in(ArmState wanted) const {
  return std::any_of(states.begin(), states.end(), [&](const controller_state_t& s) {
    return static_cast<ArmState>(s.state) == wanted;
  });
}

double Rig::metric(const std::string& name) const {
  for (size_t i = 0; i < health().metric_names.size(); ++i) {
    if (health().metric_names[i] == name) return health().metric_values[i];
  }
  ADD_FAILURE() << "no metric " << name;
  return 0;
}

double Rig::largest_torque_nm() const {
  double largest = 0;
  for (const double torque : torques.back().motor_torque_nm) {
    largest = std::max(largest, std::abs(torque));
  }
  return largest;
}

}  // namespace foresight
