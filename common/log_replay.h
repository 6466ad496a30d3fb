// Runs one process on logs instead of LCM, on a simulated clock that follows the logs' time-stamps,
// and writes what it publishes to another log. Same logs, parameters and build give the same bytes.
#pragma once

#include <string>
#include <vector>

#include "common/host.h"
#include "common/simulation.h"

namespace foresight {

struct LogReplay {
  std::string process;            // its name
  std::vector<std::string> logs;  // [robot=|operator=]FILE; several are merged by their stamps
  std::string output;             // never one of the logs
  Domain home = Domain::kRobot;   // of logs without a prefix
  std::vector<Domain> health_domains;
};

/// Does all that can be done and says on stderr, in a line for each log, what could not be read and
/// which stamps no recorder leaves; then the result is kExitUnavailable. Throws StartupError when a
/// log cannot be opened, the output is one of them, or it could not be written: then a file that
/// was there before is as it was.
[[nodiscard]] int replay_logs(const LogReplay& replay, const Simulation::Factory& factory);

}  // namespace foresight
