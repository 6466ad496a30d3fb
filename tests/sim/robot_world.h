// A simulated robot and a simple controller on one simulated clock, and all that they say.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "common/simulation.h"
#include "sim/robot/process.h"
#include "tests/sim/test_arms.h"

namespace foresight::sim {

/// Proportional and damping torques towards a target, and what gravity asks for.
class TestController : public Process {
 public:
  TestController(Node& node, const ArmModel& arm)
      : dynamics_(arm),
        target_rad_(arm.home()),
        torques_(node.advertise<arm_torques_t>({.channel = "ARM_TORQUES"})) {
    node.subscribe<arm_encoders_t>({.channel = "ARM_ENCODERS"}, Queue::kAll,
                                   [this](const arm_encoders_t& m) { on_encoders(m); });
  }
  void set_target(const JointVector& target_rad) { target_rad_ = target_rad; }
  void set_extra_torque(double motor_torque_nm) { extra_nm_ = motor_torque_nm; }

 private:
  void on_encoders(const arm_encoders_t& message) {
    const ArmModel& arm = dynamics_.arm();
    const JointVector motor_rad = JointVector::NullaryExpr(arm.size(), [&](Eigen::Index i) {
      return message.motor_counts[static_cast<size_t>(i)] * 2 * 3.14159265358979 /
             arm.counts_per_revolution;
    });
    const JointVector q = arm.motor_from_joint.lu().solve(motor_rad);
    if (last_rad_.size() == 0) velocity_ = JointVector::Zero(arm.size());
    if (last_rad_.size() != 0) velocity_ += 0.3 * ((q - last_rad_) / 0.002 - velocity_);
    last_rad_ = q;
    const JointVector zero = JointVector::Zero(arm.size());
    JointVector torque_nm = dynamics_.inverse(dynamics_.place(q), zero, zero, {});
    for (int i = 0; i < arm.size(); ++i) {
      const double limit_nm = arm.joints[static_cast<size_t>(i)].torque_limit_nm;
      torque_nm[i] += limit_nm * (20 * (target_rad_[i] - q[i]) - 1.5 * velocity_[i]);
      torque_nm[i] = std::clamp(torque_nm[i], -limit_nm, limit_nm);
    }
    JointVector motor_nm = arm.motor_from_joint.transpose().lu().solve(torque_nm);
    motor_nm[0] += extra_nm_;
    arm_torques_t answer{};
    answer.utime = message.utime;
    answer.n_motors = arm.size();
    answer.motor_torque_nm.assign(motor_nm.begin(), motor_nm.end());
    torques_.publish(answer);
  }

  ArmDynamics dynamics_;
  JointVector target_rad_, last_rad_, velocity_;
  double extra_nm_ = 0;
  Publisher<arm_torques_t> torques_;
};

class RobotWorld : public testing::Test {
 protected:
  RobotWorld() {
    params_.arm_file = std::string(FORESIGHT_ARMS) + "/wam4.yaml";
    params_.camera_rate_hz = 0;
    world_.set_tap([this](Time, Domain domain, const std::string& channel, auto bytes) {
      log_.push_back({domain, channel, {bytes.begin(), bytes.end()}});
    });
  }
  void start() {
    world_.add("sim", {Domain::kRobot},
               [this](Node& node) { return std::make_unique<SimProcess>(node, params_); });
  }
  void add_controller() {
    const ArmModel arm = load_arm_file(params_.arm_file);
    controller_ = static_cast<TestController*>(&world_.add(
        "controller", {}, [&](Node& node) { return std::make_unique<TestController>(node, arm); }));
  }
  void run(double duration_s) { world_.run_until(world_.now() + seconds(duration_s)); }

  void press(int8_t button) {
    pendant_t message{};
    message.utime = world_.now().us;
    message.button = button;
    world_.inject(world_.now(), Domain::kRobot, "PENDANT", encode(message));
  }
  template <class Message>
  std::vector<Message> all(const std::string& channel, Domain domain = Domain::kRobot) const {
    std::vector<Message> messages;
    for (const Said& said : log_) {
      if (said.channel != channel || said.domain != domain) continue;
      EXPECT_GT(
          messages.emplace_back().decode(said.bytes.data(), 0, static_cast<int>(said.bytes.size())),
          0);
    }
    return messages;
  }
  template <class Message>
  Message newest(const std::string& channel) const {
    const auto messages = all<Message>(channel);
    EXPECT_FALSE(messages.empty()) << channel;
    return messages.empty() ? Message{} : messages.back();
  }
  JointVector true_position() const {
    const auto truth = newest<truth_t>("TRUTH_STATE");
    return JointVector::Map(truth.joint_position_rad.data(), truth.n_joints);
  }
  std::map<std::string, double> metrics() const {
    const auto health = newest<health_t>("HEALTH");
    std::map<std::string, double> values;
    for (int i = 0; i < health.n_metrics; ++i) {
      values[health.metric_names[static_cast<size_t>(i)]] =
          health.metric_values[static_cast<size_t>(i)];
    }
    return values;
  }

  struct Said {
    Domain domain;
    std::string channel;
    std::vector<uint8_t> bytes;
    bool operator==(const Said&) const = default;
  };
  SimParams params_;
  Simulation world_{Time{1'000'000'000}};
  TestController* controller_ = nullptr;
  std::vector<Said> log_;
};

}  // namespace foresight::sim
