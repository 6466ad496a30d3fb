#include "sim/swarm/swarm.h"

#include <algorithm>

#include "common/errors.h"

namespace foresight {
namespace {

// An arbitrary instant: nothing may depend on it.
constexpr Time kStart{1'000'000'000'000};

}  // namespace

Swarm::Swarm(std::vector<std::string> settings) : settings_(std::move(settings)), world_(kStart) {}

ParamSource Swarm::source_for(const std::string& process, const std::vector<std::string>& defaults,
                              const std::vector<std::string>& settings) {
  ParamSource source;
  for (const std::string& assignment : defaults) source.override_with(assignment);
  for (const std::string& setting : settings) {
    if (setting.starts_with(process + "."))
      source.override_with(setting.substr(process.size() + 1));
  }
  return source;
}

Process& Swarm::restart(const std::string& process) {
  world_.remove(process);
  return adders_.at(process)();
}

void check_settings(const std::vector<std::string>& settings,
                    const std::vector<std::string>& processes) {
  std::string known;
  for (const std::string& p : processes) known += (known.empty() ? "" : ", ") + p;
  for (const std::string& s : settings) {
    const size_t dot = s.find('.');
    const std::string process = s.substr(0, dot);
    if (dot == std::string::npos ||
        std::find(processes.begin(), processes.end(), process) == processes.end()) {
      throw UsageError("--set " + s + ": must be process.key=value with process one of " + known);
    }
  }
}

}  // namespace foresight
