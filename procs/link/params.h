#pragma once

#include <string>
#include <vector>

#include "common/params.h"
#include "procs/link/shaper.h"

namespace foresight {

struct LinkParams {
  ShaperOptions to_operator{.delay_s = 0.15};
  ShaperOptions to_robot{.delay_s = 0.15};
  std::vector<std::string> to_operator_channels = {
      "CAMERA_INFO", "VIEW",      "MESH",        "JOINT_STATE", "CONTROLLER_STATE",
      "ALIGNMENT",   "BASE_POSE", "SLAM_ANSWER", "HEALTH"};
  std::vector<std::string> to_robot_channels = {"JOINT_COMMAND", "SNAPSHOT_REQUEST",
                                                "SLAM_COMMAND"};
  double queue_limit_mb = 128;
  int seed = 1;
  bool realtime = true;

  template <class V>
  void visit(V& v) {
    v("to_operator_delay_s", to_operator.delay_s, kDelay);
    v("to_operator_jitter_s", to_operator.jitter_s, kJitter);
    v("to_operator_loss", to_operator.loss, kLoss);
    v("to_operator_reorder", to_operator.reorder, kReorder);
    v("to_operator_rate_bytes_per_s", to_operator.rate_bytes_per_s, kRate);
    v("to_robot_delay_s", to_robot.delay_s, kDelay);
    v("to_robot_jitter_s", to_robot.jitter_s, kJitter);
    v("to_robot_loss", to_robot.loss, kLoss);
    v("to_robot_reorder", to_robot.reorder, kReorder);
    v("to_robot_rate_bytes_per_s", to_robot.rate_bytes_per_s, kRate);
    v("to_operator_channels", to_operator_channels,
      {.doc = "channels passed from the robot's to the operator's site"});
    v("to_robot_channels", to_robot_channels,
      {.doc = "channels passed from the operator's to the robot's site"});
    v("queue_limit_mb", queue_limit_mb,
      {.unit = "MB",
       .min = 0.001,
       .max = 1e5,
       .doc = "of messages under way in a direction; beyond it what arrives is dropped"});
    v("seed", seed, {.unit = "1", .min = 0, .max = 2e9, .doc = "of jitter, loss and re-ordering"});
    v("realtime", realtime,
      {.doc = "real-time scheduling where it is permitted: delays stay exact under load"});
  }

 private:
  static inline const ParamSpec kDelay{
      .unit = "s", .min = 0, .max = 60, .doc = "constant delay of this direction"};
  static inline const ParamSpec kJitter{
      .unit = "s",
      .min = 0,
      .max = 10,
      .doc = "the delay varies uniformly by plus or minus this much"};
  static inline const ParamSpec kLoss{
      .unit = "1", .min = 0, .max = 1, .doc = "share of messages dropped"};
  static inline const ParamSpec kReorder{
      .unit = "1",
      .min = 0,
      .max = 1,
      .doc = "share of messages held back so that later ones overtake them"};
  static inline const ParamSpec kRate{
      .unit = "B/s", .min = 0, .max = 1e12, .doc = "capacity of this direction; 0: unlimited"};
};

}  // namespace foresight
