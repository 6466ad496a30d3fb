// The whole line on recorded video in one thread on one simulated clock: camera → slam → carver →
// mesher → link → renderer. Two runs give the same bytes. Used by `evaluate` and by the swarm
// tests.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "procs/camera/process.h"
#include "procs/renderer/process.h"
#include "sim/swarm/swarm.h"

namespace foresight {

struct RecordedLineOptions {
  std::string sequence;  // folder or video
  double delay_s = 0.3;  // age of what reaches the operator
  int first_frame = 0;
  int frame_count = 0;                     // 0: all
  std::vector<std::string> settings = {};  // "process.key=value"
};

class RecordedLine {
 public:
  /// Builds and starts all processes. Throws StartupError.
  explicit RecordedLine(const RecordedLineOptions& options);

  Simulation& world() { return swarm_.world(); }
  RendererProcess& renderer() { return *renderer_; }
  /// Distortion-afflicted intrinsics of IMAGE.
  CameraModel camera() const { return camera_->camera(); }
  double delay_s() const { return options_.delay_s; }
  /// Which images were published, which could not be, and what the intrinsics are.
  const CameraProcess& source() const { return *camera_; }
  /// Runs for 10 ms; false when the source has ended and the link has drained.
  bool step();
  /// Ends a process as SIGKILL would and starts it anew.
  void restart(const std::string& process);

 private:
  RecordedLineOptions options_;
  Swarm swarm_;
  RendererProcess* renderer_ = nullptr;
  CameraProcess* camera_ = nullptr;
  Time end_;
  bool ended_ = false;
};

}  // namespace foresight
