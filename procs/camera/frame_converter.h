// Turns a source's frame into IMAGE: reduces the size, removes distortion, encodes. Frames that
// need nothing of it keep their own JPEG bytes.
#pragma once

#include <optional>

#include "common/camera_model.h"
#include "foresight/image_t.hpp"
#include "procs/camera/frame_source.h"
#include "procs/camera/params.h"

namespace foresight {

class FrameConverter {
 public:
  /// `camera`: intrinsics for frames as the source delivers them.
  FrameConverter(const CameraModel& camera, const CameraParams& params);
  /// Intrinsics of what convert() returns.
  const CameraModel& output_camera() const { return output_; }
  /// Nothing when the frame cannot be decoded or has not the camera file's size.
  std::optional<image_t> convert(const Frame& frame);
  /// Why the last one was refused; empty if it was not.
  const std::string& error() const { return error_; }
  /// What was odd about the last one.
  const std::string& warning() const { return warning_; }

 private:
  void build_maps();

  CameraModel input_, output_;
  CameraParams params_;
  double scale_;
  std::vector<float> map_x_, map_y_;  // of undistortion, per output pixel
  std::string error_, warning_;
};

}  // namespace foresight
