#pragma once

#include <memory>
#include <optional>

#include "common/node.h"
#include "common/process_main.h"
#include "foresight/camera_info_t.hpp"
#include "foresight/camera_pose_t.hpp"
#include "foresight/image_t.hpp"
#include "procs/camera/frame_converter.h"
#include "procs/camera/frame_source.h"
#include "procs/camera/input_report.h"
#include "procs/camera/params.h"

namespace foresight {

/// Publishes IMAGE and CAMERA_INFO from a device or a recording (paper §II).
class CameraProcess : public Process {
 public:
  using Params = CameraParams;
  static constexpr ProcessInfo kInfo{
      "camera", "Publishes frames of a camera, a video file or an image folder on LCM.",
      Domain::kRobot};

  CameraProcess(Node& node, const CameraParams& params);
  void start() override;
  /// Intrinsics of the published frames; valid after start().
  const CameraModel& camera() const { return converter_->output_camera(); }
  bool intrinsics_are_guessed() const { return guessed_; }
  /// What was used so far and what was not.
  const InputReport& report() const { return report_; }

 private:
  std::optional<Frame> skip_to_first_frame();
  std::optional<Frame> first_usable_frame(Picture* picture);
  void refuse(const Frame& frame, const std::string& why);
  void publish_info();
  void read_device();
  void prepare_next();
  void schedule();
  void publish_recorded();
  void on_pose(const camera_pose_t& pose);
  void on_stall();
  void end_of_source();
  bool publish(const Frame& frame, Time time);
  Time stamp_of(const Frame& frame);

  Node& node_;
  CameraParams params_;
  Publisher<image_t> images_;
  Publisher<camera_info_t> infos_;
  std::shared_ptr<FrameSource> source_;
  std::unique_ptr<FrameConverter> converter_;
  std::optional<Frame> next_;
  InputReport report_;
  std::string note_;  // about all frames, while nothing is wrong
  bool guessed_ = false;
  int published_ = 0, stall_mark_ = 0;
  Time first_stamp_, base_, last_published_;
  bool began_ = false, ended_ = false;
};

}  // namespace foresight
