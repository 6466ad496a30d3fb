// A device that plays a file: waypoints, or a person's recorded motion (motion.h).
#pragma once

#include <optional>
#include <string>

#include "procs/omni/input_device.h"
#include "procs/omni/motion.h"

namespace foresight {

struct FileOptions {
  std::string path;
  MotionStyle style = MotionStyle::kLinear;
  double start_delay_s = 1;  // at the first sample, not engaged
  bool loop = false;         // from the end to the first sample, the clutch let go once
};

class FileDevice : public InputDevice {
 public:
  explicit FileDevice(FileOptions options) : options_(std::move(options)) {}
  void open() override;
  DeviceReading read(Time now) override;

 private:
  FileOptions options_;
  std::optional<Motion> motion_;
  std::optional<Time> started_;
  double passes_ = 0;
};

/// Samples of a table (.csv, .txt), or of DEVICE_STATE in an LCM log (any other name), from time 0.
/// Throws ConfigError, UnavailableError.
std::vector<MotionSample> read_motion_file(const std::string& path);

}  // namespace foresight
