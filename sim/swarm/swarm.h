// Processes of ours in one thread on one simulated clock, with settings as on a command line. What
// RecordedLine and ClosedLoop are made of.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/process_main.h"
#include "common/simulation.h"

namespace foresight {

class Swarm {
 public:
  /// `settings`: "process.key=value", each for a process that is added later.
  explicit Swarm(std::vector<std::string> settings);

  /// Adds a process with these parameters ("key=value"), changed by the settings for it.
  template <class P>
  P& add(const std::vector<std::string>& defaults) {
    const auto make = process_maker<P>()(source_for(P::kInfo.name, defaults, settings_), nullptr);
    adders_[P::kInfo.name] = [this, make]() -> Process& {
      return world_.add(P::kInfo.name, health_domains(P::kInfo), make);
    };
    return static_cast<P&>(adders_[P::kInfo.name]());
  }
  /// Kills a process as SIGKILL would and starts it anew; returns the new one.
  Process& restart(const std::string& process);
  Simulation& world() { return world_; }

  /// The parameters that a process has under such settings.
  template <class P>
  static typename P::Params params(const std::vector<std::string>& settings) {
    return load_params<typename P::Params>(source_for(P::kInfo.name, {}, settings));
  }

 private:
  static ParamSource source_for(const std::string& process,
                                const std::vector<std::string>& defaults,
                                const std::vector<std::string>& settings);

  std::vector<std::string> settings_;
  Simulation world_;
  std::map<std::string, std::function<Process&()>> adders_;
};

/// Throws UsageError unless each setting is process.key=value of one of these processes.
void check_settings(const std::vector<std::string>& settings,
                    const std::vector<std::string>& processes);

}  // namespace foresight
