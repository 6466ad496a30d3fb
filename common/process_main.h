// The main() of every process:
//
//   int main(int argc, char** argv) { return foresight::process_main<MesherProcess>(argc, argv); }
//
// where MesherProcess has `using Params`, `static constexpr ProcessInfo kInfo` and the constructor
// (Node&, const Params&). It gives each process the same command line: live on LCM (default),
// --describe, --replay LOG --output LOG, --params FILE, --set key=value, --help.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "common/node.h"
#include "common/params.h"

namespace foresight {

struct ProcessInfo {
  const char* name;
  const char* summary;
  Domain home;
  bool reports_to_both_domains = false;
};

std::vector<Domain> health_domains(const ProcessInfo& info);

/// Loads and checks the parameters (throws ConfigError), describes them, returns the constructor.
using ProcessMaker = std::function<std::function<std::unique_ptr<Process>(Node&)>(
    ParamSource, std::vector<ParamDescription>*)>;

template <class P>
ProcessMaker process_maker() {
  return [](ParamSource source, std::vector<ParamDescription>* descriptions) {
    auto params = load_params<typename P::Params>(std::move(source), descriptions);
    return [params](Node& node) -> std::unique_ptr<Process> {
      return std::make_unique<P>(node, params);
    };
  };
}

int run_process(int argc, char** argv, const ProcessInfo& info, const ProcessMaker& make);

template <class P>
int process_main(int argc, char** argv) {
  return run_process(argc, argv, P::kInfo, process_maker<P>());
}

}  // namespace foresight
