// session-report: figures and series of a recorded session with the simulated robot; see session.h.
// scripts/report draws them as a page.
#include "bench/session_report/session.h"
#include "common/tool_main.h"

int main(int argc, char** argv) {
  using namespace foresight;
  std::string robot_log, operator_log, output = "out/report";
  SessionOptions options;
  CLI::App app(
      "What a recorded session of the simulated robot was worth: errors over time as CSV, "
      "figures as JSON.",
      "session-report");
  app.add_option("robot", robot_log, "log of the robot's domain, TRUTH_STATE included")->required();
  app.add_option("operator", operator_log, "log of the operator's domain")->required();
  app.add_option("--output", output, "folder")->capture_default_str();
  app.add_option("--scene", options.scene, "sim's scene")->capture_default_str();
  app.add_option("--seed", options.seed, "sim's seed")->capture_default_str();
  return tool_main(app, argc, argv, [&] {
    Session session(options);
    session.read(robot_log, operator_log);
    session.write(output);
    return kExitDone;
  });
}
