// sequence-log: what camera would publish for a folder, as an LCM log, without a network.
#include <cstdio>

#include "common/errors.h"
#include "common/lcm_log.h"
#include "common/simulation.h"
#include "procs/camera/process.h"

namespace foresight {
namespace {

void write_log(const std::string& folder, const std::string& path) {
  LogWriter log(path);
  Simulation world(Time{1'000'000'000'000});
  world.set_tap([&](Time time, Domain, const std::string& channel, auto bytes) {
    log.write(time, channel, bytes);
  });
  ParamSource source;
  source.override_with("source=" + folder);
  source.override_with("exit_at_end=true");
  world.add("camera", {Domain::kRobot}, process_maker<CameraProcess>()(std::move(source), nullptr));
  while (!world.is_stopped()) world.run_until(world.now() + milliseconds(100));
  log.close();
}

}  // namespace
}  // namespace foresight

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: sequence-log FOLDER OUT.lcmlog\n");
    return 64;
  }
  try {
    foresight::write_log(argv[1], argv[2]);
  } catch (const foresight::StartupError& e) {
    std::fprintf(stderr, "sequence-log: %s\n", e.what());
    return e.code();
  }
  return 0;
}
