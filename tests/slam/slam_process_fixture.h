// slam on a simulated bus, with a scene before its camera and everything that it says.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/messages.h"
#include "common/simulation.h"
#include "foresight/health_t.hpp"
#include "foresight/pose_hint_t.hpp"
#include "foresight/slam_answer_t.hpp"
#include "foresight/slam_command_t.hpp"
#include "procs/slam/process.h"
#include "tests/common/files.h"
#include "tests/slam/synthetic_scene.h"

namespace foresight {

constexpr Duration kPeriod = milliseconds(33);

class SlamProcessTest : public testing::Test {
 protected:
  SlamProcessTest() {
    params_.mapping_cost_s = 0.02;
    params_.map_root = temp_.path() + "/maps";
    world_.set_tap([this](Time, Domain, const std::string& channel, auto bytes) {
      const int size = static_cast<int>(bytes.size());
      if (channel == "CAMERA_POSE") {
        ASSERT_GT(pose_.decode(bytes.data(), 0, size), 0);
        ++poses_;
      }
      if (channel == "VIEW") ++views_;
      if (channel == "MAP_DELTA") {
        map_delta_t delta;
        ASSERT_GT(delta.decode(bytes.data(), 0, size), 0);
        if (delta.header.is_snapshot != 0 && delta.header.part == 0) ++snapshots_;
      }
      if (channel == "SLAM_ANSWER") {
        slam_answer_t answer;
        ASSERT_GT(answer.decode(bytes.data(), 0, size), 0);
        answers_.push_back(answer);
      }
      if (channel == "HEALTH") {
        ASSERT_GT(health_.decode(bytes.data(), 0, size), 0);
      }
    });
    add_slam(std::nullopt);
    send_camera(camera_);
  }
  void add_slam(const std::optional<RunIdentity>& run) {
    world_.add("slam", {Domain::kRobot},
               [&](Node& node) { return std::make_unique<SlamProcess>(node, params_, run); });
  }

  template <class Message>
  void send(const std::string& channel, const Message& message) {
    world_.inject(world_.now(), Domain::kRobot, channel, encode(message));
    world_.run_until(world_.now());
  }
  void send_camera(const CameraModel& camera) {
    send("CAMERA_INFO", to_message(camera, world_.now()));
  }
  void wait(Duration duration) { world_.run_until(world_.now() + duration); }
  void send_image(const cv::Mat& image, Time stamp) {
    image_t m{};
    m.utime = stamp.us;
    m.frame_number = ++frame_number_;
    m.width_px = static_cast<int16_t>(image.cols);
    m.height_px = static_cast<int16_t>(image.rows);
    m.encoding = image_t::ENCODING_GRAY8;
    m.n_data = image.rows * image.cols;
    m.data.assign(image.data, image.data + m.n_data);
    send("IMAGE", m);
  }
  void step(const cv::Mat& image) {
    wait(kPeriod);
    send_image(image, world_.now() + clock_offset_);
  }
  void step(double t) {
    cv::Mat& image = images_[t];
    if (image.empty()) image = scene_.render(camera_, sideways_pose(t));
    step(image);
  }
  // Another camera says so for long enough to be believed.
  void change_camera(const CameraModel& camera, const Pose<World, Cam>& pose) {
    const cv::Mat image = scene_.render(camera, pose);
    for (int i = 0; i < 4; ++i) {
      send_camera(camera);
      for (int k = 0; k < 30 && i < 3; ++k) step(image);
    }
  }
  void sweep(double from, double to, int count) {
    for (int i = 1; i <= count; ++i) step(from + (to - from) * i / count);
  }
  void start_map() {
    sweep(0, 0.6, 36);
    ASSERT_EQ(pose_.state, +camera_pose_t::STATE_TRACKING) << pose_.reason;
  }
  double metric(const std::string& name) const {
    for (int i = 0; i < health_.n_metrics; ++i) {
      const auto n = static_cast<size_t>(i);
      if (health_.metric_names[n] == name) return health_.metric_values[n];
    }
    ADD_FAILURE() << "no metric " << name;
    return -1;
  }
  int64_t rejected(const std::string& channel) const {
    for (const port_health_t& port : health_.ports) {
      if (port.channel == channel) return port.rejected;
    }
    ADD_FAILURE() << "no port " << channel;
    return -1;
  }
  void expect_tracking_in(int64_t epoch) {
    EXPECT_EQ(pose_.state, +camera_pose_t::STATE_TRACKING) << pose_.reason;
    EXPECT_EQ(pose_.epoch, epoch);
  }

  TemporaryFolder temp_;
  SlamParams params_;
  CameraModel camera_ = test_camera();
  SyntheticScene scene_{5};
  std::map<double, cv::Mat> images_;  // rendered, by t
  Simulation world_{Time{} + seconds(100'000)};
  Duration clock_offset_;  // of the camera's clock
  camera_pose_t pose_{};
  health_t health_{};
  std::vector<slam_answer_t> answers_;
  int32_t frame_number_ = 0;
  int poses_ = 0, views_ = 0, snapshots_ = 0;
};

}  // namespace foresight
