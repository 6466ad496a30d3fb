// A device that plays a file: waypoints, or a person's recorded motion (motion.h). When the robot
// does not follow, it stands still and lets go, for good unless it resumes.
#pragma once

#include <optional>
#include <string>

#include "procs/omni/input_device.h"
#include "procs/omni/motion.h"
#include "procs/omni/playback.h"

namespace foresight {

struct FileOptions {
  std::string path;
  MotionStyle style = MotionStyle::kLinear;
  double start_delay_s = 1;  // at the first sample, not engaged
  bool loop = false;         // from the end to the first sample, the clutch let go once
  bool resume = false;       // goes on by itself when the robot is ready again
};

class FileDevice : public InputDevice {
 public:
  explicit FileDevice(FileOptions options)
      : options_(std::move(options)), playback_(options_.start_delay_s, options_.resume) {}
  void open() override;
  DeviceReading read(Time now) override;
  void allow_engaging(bool may_engage) override { playback_.allow(may_engage); }

 private:
  FileOptions options_;
  AxisKind kind_ = AxisKind::kPosition;
  std::optional<Motion> motion_;
  Playback playback_;
  double passes_ = 0;
};

/// What a file holds: of kVelocity, the samples' numbers are deflections.
struct RecordedMotion {
  AxisKind kind = AxisKind::kPosition;
  std::vector<MotionSample> samples;
};

/// A table (.csv, .txt) of joints, or the DEVICE_STATE of an LCM log (any other name), of the kind
/// that it has more of; from time 0. Throws ConfigError, UnavailableError.
RecordedMotion read_motion_file(const std::string& path);
/// Which device the DEVICE_STATE of a log is of; empty for a table and when there is none.
/// Throws UnavailableError.
std::string recorded_device(const std::string& path);

}  // namespace foresight
