// The renderer on a simulated clock, before a still scene, with everything that the robot's side
// sends: streams can be stopped, delayed, stamped by another clock, and forged.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "common/arm_model.h"
#include "common/robot_messages.h"
#include "common/simulation.h"
#include "foresight/controller_state_t.hpp"
#include "foresight/display_stats_t.hpp"
#include "foresight/health_t.hpp"
#include "procs/renderer/process.h"
#include "tests/renderer/test_scene.h"

namespace foresight {

constexpr int64_t kDisplayEpoch = 999'000'000'000;
constexpr Time kDisplayStart{1'000'000'000'000};

class DisplayRig {
 public:
  DisplayRig();

  /// Change these before start().
  RendererParams params;
  /// Change these at any time.
  Duration delay = milliseconds(150);  // each way
  Duration robot_clock = {};           // ahead of the operator's
  controller_state_t controller{};
  int joint_count = 4;            // of JOINT_STATE
  std::set<std::string> stopped;  // channels
  std::set<int64_t> senders{kDisplayStart.us - 1};
  std::function<void(Time)> every_10_ms = [](Time) {};

  void start();
  void run(double for_s);
  template <class Message>
  void inject(const char* channel, const Message& message, Domain domain = Domain::kOperator) {
    world().inject(now(), domain, channel, encode(message));
  }

  Simulation& world() { return *world_; }
  Time now() const { return world_->now(); }
  const health_t& health() const { return health_; }
  double metric(const std::string& name) const;
  const port_health_t& port(const std::string& channel, Domain domain) const;
  /// Since the last call: drawn at all, and as a prediction.
  struct Drawn {
    int pictures = 0, predictions = 0;
  };
  Drawn take_drawn() { return std::exchange(drawn_, {}); }
  const PredictedFrame& frame() const { return frame_; }

  // What the robot's side sends now; bend it and inject it.
  camera_info_t camera_info() const;
  view_t view() const;
  mesh_t mesh() const;
  joint_state_t joint_state() const;
  base_pose_t base() const;
  alignment_t alignment() const;
  joint_command_t command(int64_t session) const;

 private:
  void tick(int i);
  template <class Message>
  void send(const char* channel, const Message& message);
  Time robot_time() const { return now() + robot_clock; }

  TestScene scene_;
  CameraModel camera_;
  Pose<Map, Cam> map_from_cam_;
  ArmModel arm_;
  std::vector<uint8_t> picture_;
  mesh_t mesh_;
  std::unique_ptr<Simulation> world_;
  health_t health_{};
  Drawn drawn_;
  PredictedFrame frame_;
  int ticks_ = 0;
};

}  // namespace foresight
