// The complete system of the paper in one thread on one simulated clock: the operator's device
// (omni), the link, the arm's controller, the simulated arm, base and camera (sim), slam, carver,
// mesher, calibrator and renderer. Two runs give the same bytes. Used by `evaluate --sim` and by
// the swarm tests; experiments run here.
//
//   ClosedLoop loop({.seconds = 60, .delay_s = 0.3});
//   loop.world().listen(Domain::kRobot, "BASE_POSE", …);
//   while (loop.step()) {}
#pragma once

#include <string>
#include <vector>

#include "common/camera_model.h"
#include "procs/renderer/process.h"
#include "sim/robot/process.h"
#include "sim/swarm/swarm.h"

namespace foresight {

struct ClosedLoopOptions {
  double seconds = 60;
  double delay_s = 0.3;                    // there and back: half of it each way
  std::vector<std::string> settings = {};  // "process.key=value"
};

class ClosedLoop {
 public:
  /// Names of the processes, for settings.
  static const std::vector<std::string>& processes();

  /// Builds and starts all processes; takes a second to build the scene. Throws StartupError.
  explicit ClosedLoop(const ClosedLoopOptions& options);

  Simulation& world() { return swarm_.world(); }
  RendererProcess& renderer() { return *renderer_; }
  sim::SimProcess& sim() { return *sim_; }
  Time start() const { return start_; }
  /// Runs for 10 ms; false at the end.
  bool step();
  /// Ends a process as SIGKILL would and starts it anew.
  void restart(const std::string& process);

 private:
  ClosedLoopOptions options_;
  Swarm swarm_;
  RendererProcess* renderer_ = nullptr;
  sim::SimProcess* sim_ = nullptr;
  Time start_;
};

}  // namespace foresight
