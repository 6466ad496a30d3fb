#include "bench/evaluate/recorded_line.h"

#include "common/errors.h"
#include "procs/camera/process.h"
#include "procs/carver/process.h"
#include "procs/link/process.h"
#include "procs/mesher/process.h"
#include "procs/slam/process.h"

namespace foresight {
namespace {

// An arbitrary instant: nothing may depend on it.
constexpr Time kStart{1'000'000'000'000};
constexpr Duration kStep = milliseconds(10);

std::string text(double v) { return std::to_string(v); }

}  // namespace

template <class P>
P& RecordedLine::add(const std::vector<std::string>& defaults) {
  const std::string name = P::kInfo.name;
  ParamSource source;
  for (const std::string& assignment : defaults) source.override_with(assignment);
  for (const std::string& setting : options_.settings) {
    if (setting.starts_with(name + ".")) source.override_with(setting.substr(name.size() + 1));
  }
  const auto make = process_maker<P>()(std::move(source), nullptr);
  adders_[name] = [this, name, make]() -> Process& {
    return world_.add(name, health_domains(P::kInfo), make);
  };
  return static_cast<P&>(adders_[name]());
}

void RecordedLine::restart(const std::string& process) {
  world_.remove(process);
  Process& added = adders_.at(process)();
  if (process == RendererProcess::kInfo.name) renderer_ = static_cast<RendererProcess*>(&added);
}

RecordedLine::RecordedLine(const RecordedLineOptions& options) : options_(options), world_(kStart) {
  add<SlamProcess>({});
  add<CarverProcess>({});
  add<MesherProcess>({});
  add<LinkProcess>({"to_operator_delay_s=" + text(options.delay_s), "to_robot_delay_s=0"});
  renderer_ = &add<RendererProcess>({"display=headless", "idle_rate_hz=1"});
  const auto& camera = add<CameraProcess>(
      {"source=" + options.sequence, "first_frame=" + std::to_string(options.first_frame),
       "frame_count=" + std::to_string(options.frame_count), "exit_at_end=true"});
  camera_ = camera.camera();
}

bool RecordedLine::step() {
  world_.run_until(world_.now() + kStep);
  if (!ended_ && world_.is_stopped()) {
    ended_ = true;
    end_ = world_.now() + seconds(options_.delay_s);
  }
  return !ended_ || world_.now() < end_;
}

}  // namespace foresight
