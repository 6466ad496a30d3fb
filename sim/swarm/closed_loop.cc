#include "sim/swarm/closed_loop.h"

#include "procs/calibrator/process.h"
#include "procs/carver/process.h"
#include "procs/link/process.h"
#include "procs/mesher/process.h"
#include "procs/omni/process.h"
#include "procs/slam/process.h"
#include "procs/wam_controller/process.h"

namespace foresight {
namespace {

constexpr Duration kStep = milliseconds(10);

}  // namespace

const std::vector<std::string>& ClosedLoop::processes() {
  static const std::vector<std::string> names{"sim",  "wam_controller", "omni",
                                              "slam", "carver",         "mesher",
                                              "link", "calibrator",     "renderer"};
  return names;
}

ClosedLoop::ClosedLoop(const ClosedLoopOptions& options)
    : options_(options), swarm_(options.settings), start_(swarm_.world().now()) {
  swarm_.add<SlamProcess>({});
  swarm_.add<CarverProcess>({});
  swarm_.add<MesherProcess>({});
  swarm_.add<CalibratorProcess>({});
  swarm_.add<WamControllerProcess>({});
  const std::string half = std::to_string(options.delay_s / 2);
  swarm_.add<LinkProcess>({"to_operator_delay_s=" + half, "to_robot_delay_s=" + half});
  renderer_ = &swarm_.add<RendererProcess>(
      {"display=headless", "idle_rate_hz=1", "predict=robot", "layout=predicted"});
  sim_ = &swarm_.add<sim::SimProcess>({"truth_rate_hz=500", "base_start_s=15"});
  swarm_.add<OmniProcess>({});
}

bool ClosedLoop::step() {
  Simulation& world = swarm_.world();
  world.run_until(world.now() + kStep);
  return (world.now() - start_).seconds() < options_.seconds;
}

void ClosedLoop::restart(const std::string& process) {
  Process& added = swarm_.restart(process);
  if (process == RendererProcess::kInfo.name) renderer_ = static_cast<RendererProcess*>(&added);
  if (process == sim::SimProcess::kInfo.name) sim_ = static_cast<sim::SimProcess*>(&added);
}

}  // namespace foresight
