#include "sim/swarm/recorded_line.h"

#include "procs/camera/process.h"
#include "procs/carver/process.h"
#include "procs/link/process.h"
#include "procs/mesher/process.h"
#include "procs/slam/process.h"

namespace foresight {
namespace {

constexpr Duration kStep = milliseconds(10);

}  // namespace

void RecordedLine::restart(const std::string& process) {
  Process& added = swarm_.restart(process);
  if (process == RendererProcess::kInfo.name) renderer_ = static_cast<RendererProcess*>(&added);
  if (process == CameraProcess::kInfo.name) camera_ = static_cast<CameraProcess*>(&added);
}

RecordedLine::RecordedLine(const RecordedLineOptions& options)
    : options_(options), swarm_(options.settings) {
  swarm_.add<SlamProcess>({});
  swarm_.add<CarverProcess>({});
  swarm_.add<MesherProcess>({});
  swarm_.add<LinkProcess>(
      {"to_operator_delay_s=" + std::to_string(options.delay_s), "to_robot_delay_s=0"});
  renderer_ = &swarm_.add<RendererProcess>({"display=headless", "idle_rate_hz=1"});
  camera_ = &swarm_.add<CameraProcess>(
      {"source=" + options.sequence, "first_frame=" + std::to_string(options.first_frame),
       "frame_count=" + std::to_string(options.frame_count), "exit_at_end=true"});
}

bool RecordedLine::step() {
  Simulation& world = swarm_.world();
  world.run_until(world.now() + kStep);
  const bool source_failed = world.node(CameraProcess::kInfo.name).state() == ProcessState::kFailed;
  if (!ended_ && (world.is_stopped() || source_failed)) {
    ended_ = true;
    end_ = world.now() + seconds(options_.delay_s);
  }
  return !ended_ || world.now() < end_;
}

}  // namespace foresight
