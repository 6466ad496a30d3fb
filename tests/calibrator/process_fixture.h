// A calibrator on a simulated bus with the robot that it listens to, and what it says.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/messages.h"
#include "common/simulation.h"
#include "procs/calibrator/process.h"
#include "tests/calibrator/simulated_robot.h"

namespace foresight {

inline constexpr const char* kArm = FORESIGHT_SOURCE_DIR "/deploy/arms/wam4.yaml";

class ProcessFixture : public testing::Test, public RobotListener {
 protected:
  void start(const RobotOptions& robot, CalibratorParams params = {}) {
    params.arm_file = kArm;
    robot_ = std::make_unique<SimulatedRobot>(load_arm_file(kArm), robot);
    world_ = std::make_unique<Simulation>(robot_->now());
    world_->set_tap([this](Time, Domain, const std::string& channel, auto bytes) {
      output_.insert(output_.end(), bytes.begin(), bytes.end());
      const int size = static_cast<int>(bytes.size());
      if (channel == "ALIGNMENT") {
        ASSERT_GT(alignment_.decode(bytes.data(), 0, size), 0);
      }
      if (channel == "POSE_HINT") {
        ASSERT_GT(hint_.decode(bytes.data(), 0, size), 0);
        ++hints_;
      }
      if (channel == "HEALTH") {
        ASSERT_GT(health_.decode(bytes.data(), 0, size), 0);
      }
      if (channel == "BASE_POSE") {
        ASSERT_GT(base_.decode(bytes.data(), 0, size), 0);
        ++base_poses_;
      }
    });
    add_calibrator(params);
    send("CAMERA_INFO", to_message(robot_->camera(), robot_->now()));
  }
  void add_calibrator(const CalibratorParams& params) {
    process_ = &dynamic_cast<CalibratorProcess&>(world_->add(
        "calibrator", {Domain::kRobot},
        [&](Node& node) { return std::make_unique<CalibratorProcess>(node, params, run_); }));
  }
  void run(double seconds_long) { robot_->run(seconds_long, this); }
  template <class Message>
  void send(const std::string& channel, const Message& message) {
    world_->inject(std::max(world_->now(), robot_->now()), Domain::kRobot, channel,
                   encode(message));
    world_->run_until(std::max(world_->now(), robot_->now()));
  }

  void on_joints(Time time, const JointVector& q) override {
    if (!joints_are_on_) return;
    joint_state_t m{};
    m.utime = time.us;
    m.n_joints = static_cast<int32_t>(q.size()) + extra_joints_;
    const auto n = static_cast<size_t>(m.n_joints);
    m.position_rad.assign(q.data(), q.data() + q.size());
    m.position_rad.resize(n);
    m.velocity_rad_per_s = m.reference_velocity_rad_per_s = std::vector<double>(n);
    m.reference_position_rad = m.target_position_rad = m.position_rad;
    send("JOINT_STATE", m);
  }
  void on_frame(const calibration::CameraFrame& frame) override {
    camera_pose_t m{};
    m.utime = frame.time.us;
    m.epoch = frame.epoch;
    m.state = frame.map_from_cam ? camera_pose_t::STATE_TRACKING : camera_pose_t::STATE_LOST;
    m.map_from_cam_quat_wxyz[0] = 1;
    if (frame.map_from_cam) write_pose(*frame.map_from_cam, &m);
    m.quality = static_cast<float>(frame.quality);
    m.points_found = frame.points_found;
    send("CAMERA_POSE", m);
    ++frames_;
  }
  void on_map(int64_t epoch, bool is_first, const MapDelta& delta) override {
    if (is_first) {
      seq_ = -1;
      whole_map_ = {};
    }
    ++seq_;
    for (const auto& k : delta.keyframes_set) whole_map_.keyframes_set.push_back(k);
    for (const auto& p : delta.points_set) whole_map_.points_set.push_back(p);
    send_map(epoch, is_first, delta);
  }
  /// As slam answers who asks for it.
  void send_whole_map() { send_map(robot_->epoch(), true, whole_map_); }
  void send_map(int64_t epoch, bool is_snapshot, const MapDelta& delta) {
    for (map_delta_t& m : split(delta, kMaxDeltaBytes)) {
      m.utime = robot_->now().us;
      m.header.epoch = epoch;
      m.header.session = 1;
      m.header.seq = seq_;
      m.header.is_snapshot = is_snapshot ? 1 : 0;
      send("MAP_DELTA", m);
    }
  }
  double metric(const std::string& name) const {
    for (size_t i = 0; i < health_.metric_names.size(); ++i) {
      if (health_.metric_names[i] == name) return health_.metric_values[i];
    }
    ADD_FAILURE() << "no metric " << name;
    return 0;
  }

  std::unique_ptr<SimulatedRobot> robot_;
  std::unique_ptr<Simulation> world_;
  CalibratorProcess* process_ = nullptr;
  alignment_t alignment_{};
  base_pose_t base_{};
  pose_hint_t hint_{};
  health_t health_{};
  std::vector<uint8_t> output_;
  int32_t seq_ = -1;
  MapDelta whole_map_;
  std::optional<RunIdentity> run_;  // none: no alignment outlives its process
  int frames_ = 0, base_poses_ = 0, hints_ = 0;
  bool joints_are_on_ = true;
  int extra_joints_ = 0;
};

}  // namespace foresight
