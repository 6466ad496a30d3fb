// Takes the robot camera's pictures beside the main thread: exposes when their time has come,
// publishes IMAGE (with TRUTH_FRAME) when the camera's latency has passed and the picture is done,
// and CAMERA_INFO at 1 Hz.
//
//   Photographer photographer(node, params);           // declares the channels
//   photographer.start(rig, robot.now(), on_done);
//   photographer.on_tick(robot);                        // after every tick
//   if (photographer.is_late_for(next_tick)) …          // a world of its own pace waits
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <vector>

#include "common/node.h"
#include "foresight/camera_info_t.hpp"
#include "foresight/image_t.hpp"
#include "foresight/truth_t.hpp"
#include "sim/robot/camera_rig.h"
#include "sim/robot/params.h"
#include "sim/robot/robot.h"

namespace foresight::sim {

truth_t to_message(const RobotTruth& truth, Time time);

class Photographer {
 public:
  Photographer(Node& node, const SimParams& params);
  /// `on_done` is called whenever a picture is done.
  void start(std::shared_ptr<CameraRig> rig, Time now, std::function<void()> on_done);

  void on_tick(const Robot& robot);
  /// A picture that must be out, or its renderer free, at `next_tick` is not.
  bool is_late_for(Time next_tick) const;

  int64_t published() const { return published_; }
  int64_t skipped() const { return skipped_; }
  /// Mean of the last second, waiting for a processor included; 0: none.
  double take_render_ms();

 private:
  struct Picture {
    Time due;
    truth_t truth{};
    std::shared_ptr<image_t> image;  // null: being rendered
  };
  Time middle_of(int64_t frame) const;
  Time end_of(int64_t frame) const;
  std::vector<Pose<World, Cam>> poses_while_open(const Robot& robot, Time middle) const;
  void expose(const Robot& robot);
  void publish_due(Time now);

  Node& node_;
  Duration latency_, shutter_;
  double rate_hz_;
  Publisher<image_t> images_;
  Publisher<camera_info_t> infos_;
  Publisher<truth_t> truths_;
  std::shared_ptr<CameraRig> rig_;
  std::function<void()> on_done_;
  Time start_, next_info_;
  int64_t next_frame_ = 0, published_ = 0, skipped_ = 0;
  std::deque<Picture> pictures_;  // in order; only the last may be unfinished
  Duration render_time_{0};
  int64_t renders_ = 0;
};

}  // namespace foresight::sim
