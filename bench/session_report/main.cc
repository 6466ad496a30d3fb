// session-report: figures and series of a recorded session with the simulated robot; see session.h.
// scripts/report draws them as a page.
#include "bench/session_report/session.h"
#include "common/output_file.h"
#include "common/tool_main.h"

int main(int argc, char** argv) {
  using namespace foresight;
  std::string robot_log, operator_log, output = "out/report";
  std::vector<std::string> settings;
  CLI::App app(
      "What a recorded session of the simulated robot was worth: errors over time as CSV, "
      "figures as JSON.",
      "session-report");
  app.add_option("robot", robot_log, "log of the robot's domain, TRUTH_STATE included")->required();
  app.add_option("operator", operator_log, "log of the operator's domain")->required();
  app.add_option("--output", output, "folder")->capture_default_str();
  app.add_option("--set", settings, "what sim was told of its scene: sim.key=value (repeatable)")
      ->allow_extra_args(false);
  return tool_main(app, argc, argv, [&] {
    check_settings(settings, {"sim"});
    check_output_folder("--output", output);
    Session session(Swarm::params<sim::SimProcess>(settings));
    session.read(robot_log, operator_log);
    session.write(output);
    session.require_whole_logs();
    return kExitDone;
  });
}
