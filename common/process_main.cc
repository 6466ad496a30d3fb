#include "common/process_main.h"

#include <CLI/CLI.hpp>
#include <iomanip>
#include <iostream>
#include <sstream>

#include "common/live_host.h"
#include "common/log_replay.h"
#include "common/simulation.h"

namespace foresight {
namespace {

struct Options {
  std::string name, params_file, robot_url, operator_url, output, clock = "wall";
  std::vector<std::string> assignments, replays;
  bool describe = false;
};

// Accepts every declaration and does nothing: enough for a constructor, which only declares.
class DescribeHost : public Host {
 public:
  Time now() const override { return {}; }
  bool is_simulated() const override { return true; }
  void publish(Domain, const std::string&, std::span<const uint8_t>) override {}
  void subscribe(Domain, const std::string&, Queue, int64_t*, Handler) override {}
  void call_every(Duration, std::function<void()>) override {}
  void call_at(Time, std::function<void()>) override {}
  void run_job(Job, Duration) override {}
  void stop(int) override {}
};

std::string number(double v) {
  std::ostringstream text;
  text << std::setprecision(9) << v;
  return text.str();
}

std::string range_of(const ParamDescription& d) {
  std::string text;
  for (const std::string& c : d.choices) text += (text.empty() ? "" : " | ") + c;
  if (!text.empty()) return text;
  if (d.min <= -1e308 && d.max >= 1e308) return {};
  return "[" + number(d.min) + ", " + (d.max >= 1e308 ? "∞" : number(d.max)) + "]";
}

std::string params_help(const std::vector<ParamDescription>& params) {
  std::string text = "\nParameters (--params FILE, --set key=value):\n";
  for (const ParamDescription& d : params) {
    const std::string unit = d.unit.empty() || d.unit == "1" ? "" : " " + d.unit;
    const std::string range = range_of(d);
    text += "  " + d.key + " = " + (d.value.empty() ? "''" : d.value) + unit +
            (range.empty() ? "" : "   " + range) + "\n      " + d.doc + "\n";
  }
  return text;
}

void emit_port(YAML::Emitter& out, const PortRecord& port) {
  out << YAML::Flow << YAML::BeginMap;
  out << YAML::Key << "channel" << YAML::Value << port.spec.channel;
  out << YAML::Key << "type" << YAML::Value << port.type;
  out << YAML::Key << "domain" << YAML::Value << to_string(port.spec.domain);
  if (port.spec.rate_hz > 0) out << YAML::Key << "rate_hz" << YAML::Value << port.spec.rate_hz;
  if (port.spec.optional) out << YAML::Key << "optional" << YAML::Value << true;
  out << YAML::Key << "doc" << YAML::Value << port.spec.doc << YAML::EndMap << YAML::Block;
}

void emit_params(YAML::Emitter& out, const std::vector<ParamDescription>& params) {
  out << YAML::Key << "params" << YAML::Value << YAML::BeginSeq;
  for (const ParamDescription& d : params) {
    out << YAML::Flow << YAML::BeginMap << YAML::Key << "key" << YAML::Value << d.key;
    out << YAML::Key << "type" << YAML::Value << d.type;
    out << YAML::Key << "value" << YAML::Value << d.value;
    if (!d.unit.empty()) out << YAML::Key << "unit" << YAML::Value << d.unit;
    if (const std::string r = range_of(d); !r.empty()) {
      out << YAML::Key << "range" << YAML::Value << r;
    }
    out << YAML::Key << "doc" << YAML::Value << d.doc << YAML::EndMap << YAML::Block;
  }
  out << YAML::EndSeq;
}

int describe(const ProcessInfo& info, const Node& node,
             const std::vector<ParamDescription>& params) {
  YAML::Emitter out;
  out << YAML::BeginMap << YAML::Key << "process" << YAML::Value << info.name;
  out << YAML::Key << "summary" << YAML::Value << info.summary;
  for (const bool inputs : {true, false}) {
    out << YAML::Key << (inputs ? "inputs" : "outputs") << YAML::Value << YAML::BeginSeq;
    for (const PortRecord& port : node.ports()) {
      if (port.is_input == inputs) emit_port(out, port);
    }
    out << YAML::EndSeq;
  }
  out << YAML::Key << "timers" << YAML::Value << YAML::BeginSeq;
  for (const TimerRecord& t : node.timers()) {
    out << YAML::Flow << YAML::BeginMap << YAML::Key << "name" << YAML::Value << t.name;
    out << YAML::Key << "period_s" << YAML::Value << t.period.seconds() << YAML::EndMap
        << YAML::Block;
  }
  out << YAML::EndSeq;
  emit_params(out, params);
  out << YAML::EndMap;
  std::cout << out.c_str() << "\n";
  return kExitDone;
}

int replay(const Options& options, const ProcessInfo& info, const Simulation::Factory& factory) {
  return replay_logs({.process = options.name,
                      .logs = options.replays,
                      .output = options.output,
                      .home = info.home,
                      .health_domains = health_domains(info)},
                     factory);
}

int run_live(const Options& options, const ProcessInfo& info, const Simulation::Factory& factory) {
  LiveHost host(options.robot_url, options.operator_url);
  if (options.clock == "published") host.follow_published_clock(info.home);
  Node node(options.name, host, health_domains(info));
  const std::unique_ptr<Process> process = factory(node);
  process->start();
  return host.run();
}

void declare_options(CLI::App& app, Options& options, const ProcessInfo& info) {
  options.name = info.name;
  options.robot_url = default_url(Domain::kRobot);
  options.operator_url = default_url(Domain::kOperator);
  app.add_option("--name", options.name, "name in HEALTH and in the log")->capture_default_str();
  app.add_option("--params", options.params_file, "YAML file with parameters");
  app.add_option("--set", options.assignments, "one parameter: key=value (repeatable)")
      ->allow_extra_args(false);
  app.add_option("--robot-url", options.robot_url, "LCM URL of the robot site");
  app.add_option("--operator-url", options.operator_url, "LCM URL of the operator site");
  app.add_option("--clock", options.clock,
                 "wall, or published: the time of a simulated world, from CLOCK")
      ->check(CLI::IsMember({"wall", "published"}))
      ->capture_default_str();
  app.add_flag("--describe", options.describe, "print ports, timers and parameters as YAML");
  auto* replay_option =
      app.add_option("--replay", options.replays,
                     "run on a log instead of LCM, deterministically: [robot=|operator=]LOG "
                     "(repeatable)")
          ->allow_extra_args(false);
  auto* output_option =
      app.add_option("--output", options.output,
                     "log that --replay writes what it published to; an earlier one is replaced "
                     "when the run is whole");
  replay_option->needs(output_option);
  output_option->needs(replay_option);
  app.set_version_flag("--version", FORESIGHT_VERSION);
}

}  // namespace

std::vector<Domain> health_domains(const ProcessInfo& info) {
  if (info.reports_to_both_domains) return {Domain::kRobot, Domain::kOperator};
  return {info.home};
}

int run_process(int argc, char** argv, const ProcessInfo& info, const ProcessMaker& make) {
  Options options;
  CLI::App app(info.summary, std::string("foresight-") + info.name);
  std::vector<ParamDescription> defaults;
  make({}, &defaults);
  declare_options(app, options, info);
  app.footer(params_help(defaults));
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp& e) {
    return app.exit(e);
  } catch (const CLI::CallForVersion& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    std::cerr << info.name << ": " << e.what() << " (see --help)\n";
    return kExitUsage;
  }
  try {
    ParamSource source =
        options.params_file.empty() ? ParamSource() : ParamSource::from_file(options.params_file);
    for (const std::string& assignment : options.assignments) source.override_with(assignment);
    std::vector<ParamDescription> params;
    const Simulation::Factory factory = make(std::move(source), &params);
    if (options.describe) {
      DescribeHost host;
      Node node(options.name, host, health_domains(info));
      const std::unique_ptr<Process> process = factory(node);
      return describe(info, node, params);
    }
    if (!options.replays.empty()) return replay(options, info, factory);
    return run_live(options, info, factory);
  } catch (const StartupError& e) {
    std::cerr << info.name << ": " << e.what() << "\n";
    return e.code();
  } catch (const std::exception& e) {
    std::cerr << info.name << ": bug: " << e.what() << "\n";
    return kExitBug;
  }
}

}  // namespace foresight
