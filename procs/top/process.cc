#include "procs/top/process.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "common/errors.h"
#include "common/lcm_bus.h"
#include "common/live_host.h"
#include "common/node.h"
#include "procs/top/table_text.h"

namespace foresight {
namespace {

// Every process reports once a second: two rounds, in case one is late.
constexpr Duration kOneRound = seconds(2.2);

struct Options {
  std::string robot_url = default_url(Domain::kRobot);
  std::string operator_url = default_url(Domain::kOperator);
  std::vector<std::string> wait;
  std::string state = "alive";
  double timeout_s = 30;
  bool once = false, json = false, all = false;
};

class Top {
 public:
  Top(const Options& options, LiveHost& host)
      : options_(options), host_(host), node_("foresight-top", host, {}), began_(node_.now()) {
    for (const Domain domain : {Domain::kRobot, Domain::kOperator}) {
      node_.subscribe<health_t>({.channel = "HEALTH", .domain = domain}, Queue::kAll,
                                [this](const health_t& m) { table_.add(node_.now(), m); });
      node_.subscribe<link_stats_t>({.channel = "LINK_STATS", .domain = domain}, Queue::kAll,
                                    [this](const link_stats_t& m) { table_.add(node_.now(), m); });
    }
    if (!options_.wait.empty()) {
      node_.every(milliseconds(50), "wait", [this] { check_wait(); });
    } else if (options_.once) {
      node_.at(began_ + kOneRound, [this] {
        print();
        host_.stop(kExitDone);
      });
    } else {
      node_.every(seconds(1), "refresh", [this] { refresh(); });
    }
  }

 private:
  void print() {
    const Colour colour = isatty(STDOUT_FILENO) != 0 ? Colour::kOn : Colour::kOff;
    const Ports ports = options_.all ? Ports::kAll : Ports::kBusy;
    std::cout << (options_.json ? to_json(table_, node_.now()) + "\n"
                                : to_text(table_, node_.now(), ports, colour))
              << std::flush;
  }

  void refresh() {
    if (!options_.json && isatty(STDOUT_FILENO) != 0) std::cout << "\x1b[H\x1b[2J";
    print();
  }

  void check_wait() {
    const Wanted wanted = options_.state == "ok" ? Wanted::kOk : Wanted::kAlive;
    const auto missing = table_.missing(options_.wait, wanted, node_.now());
    if (missing.empty()) {
      if (options_.json) print();
      return host_.stop(kExitDone);
    }
    if ((node_.now() - began_).seconds() < options_.timeout_s) return;
    std::cerr << "foresight-top: not " << options_.state << " after " << options_.timeout_s
              << " s:";
    for (const std::string& who : missing) std::cerr << " " << who;
    std::cerr << "\n";
    host_.stop(kExitUnavailable);
  }

  const Options& options_;
  LiveHost& host_;
  Node node_;
  Time began_;
  HealthTable table_;
};

void declare_options(CLI::App& app, Options& o) {
  app.add_option("--robot-url", o.robot_url, "LCM URL of the robot site")->capture_default_str();
  app.add_option("--operator-url", o.operator_url, "LCM URL of the operator site")
      ->capture_default_str();
  app.add_flag("--once", o.once, "print the table after one round of reports (2.2 s) and end");
  app.add_flag("--json", o.json, "one JSON object a line instead of the table");
  app.add_flag("--all", o.all, "also ports that never carried a message");
  app.add_option("--wait", o.wait, "wait until each of these (a,b,c) reports, then end")
      ->delimiter(',');
  app.add_option("--state", o.state, "what --wait waits for: alive (reports) or ok (OK or DONE)")
      ->check(CLI::IsMember({"alive", "ok"}))
      ->capture_default_str();
  app.add_option("--timeout", o.timeout_s, "of --wait, in seconds; then exit code 69")
      ->check(CLI::Range(0.0, 86400.0))
      ->capture_default_str();
  app.set_version_flag("--version", FORESIGHT_VERSION);
}

}  // namespace

int run_top(int argc, char** argv) {
  Options options;
  CLI::App app("Shows what every process reports: state, rates, bandwidth, latency, losses.",
               "foresight-top");
  declare_options(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    std::cerr << "foresight-top: " << e.what() << " (see --help)\n";
    return kExitUsage;
  }
  try {
    LiveHost host(options.robot_url, options.operator_url);
    Top top(options, host);
    return host.run();
  } catch (const StartupError& e) {
    std::cerr << "foresight-top: " << e.what() << "\n";
    return e.code();
  }
}

}  // namespace foresight
