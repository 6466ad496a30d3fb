// foresight-who: which processes report on the two domains, as text for scripts; see README.md.
#include <poll.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <set>
#include <utility>

#include "common/lcm_bus.h"
#include "common/message_check.h"
#include "common/tool_main.h"
#include "foresight/health_t.hpp"

namespace foresight {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr std::array<Domain, 2> kDomains = {Domain::kRobot, Domain::kOperator};

struct Options {
  std::array<std::string, 2> urls = {default_url(Domain::kRobot), default_url(Domain::kOperator)};
  double listen_s = 1.3;  // every process reports once a second
  double patience_s = 5;  // … of its own time, and a simulated world may be slow
};

// A name from the network, in a line that a script splits at tabs.
std::string printable(std::string text) {
  for (char& c : text) {
    if (c < 0x20 || c == 0x7f) c = '?';
  }
  return text.empty() ? "?" : text;
}

// One domain: what was heard there.
class Listener {
 public:
  Listener(Domain domain, const std::string& url) : domain_(domain), bus_(url) {
    bus_.subscribe(".*", [this](const std::string& channel, auto bytes) {
      has_traffic_ = true;
      if (channel != "HEALTH") return;
      const auto health = decode_checked<health_t>(bytes);
      if (health) reports_.emplace(printable(health->process), health->pid);
    });
  }

  LcmBus& bus() { return bus_; }
  /// Somebody publishes, but it was not said who.
  bool is_unexplained() const { return has_traffic_ && reports_.empty(); }
  void print() const {
    for (const auto& [process, pid] : reports_) {
      std::printf("%s\t%d\t%s\n", to_string(domain_), pid, process.c_str());
    }
    if (is_unexplained()) std::printf("%s\t0\t?\n", to_string(domain_));
  }

 private:
  Domain domain_;
  LcmBus bus_;
  bool has_traffic_ = false;
  std::set<std::pair<std::string, int32_t>> reports_;
};

int listen(const Options& options) {
  std::array<Listener, 2> listeners = {Listener(kDomains[0], options.urls[0]),
                                       Listener(kDomains[1], options.urls[1])};
  const auto begin = Clock::now();
  while (true) {
    for (Listener& listener : listeners) listener.bus().receive();
    const bool wait_on = listeners[0].is_unexplained() || listeners[1].is_unexplained();
    const double end_s = wait_on ? options.listen_s + options.patience_s : options.listen_s;
    const double left_s = end_s - Seconds(Clock::now() - begin).count();
    if (left_s <= 0) break;
    std::array<pollfd, 2> files = {pollfd{listeners[0].bus().file_descriptor(), POLLIN, 0},
                                   pollfd{listeners[1].bus().file_descriptor(), POLLIN, 0}};
    poll(files.data(), files.size(), static_cast<int>(left_s * 1000) + 1);
  }
  for (const Listener& listener : listeners) listener.print();
  return kExitDone;
}

}  // namespace
}  // namespace foresight

int main(int argc, char** argv) {
  foresight::Options options;
  CLI::App app("Prints who reports on the two domains: DOMAIN, PID, PROCESS, separated by tabs.",
               "foresight-who");
  app.add_option("--robot-url", options.urls[0], "LCM URL of the robot site")
      ->capture_default_str();
  app.add_option("--operator-url", options.urls[1], "LCM URL of the operator site")
      ->capture_default_str();
  app.add_option("--listen", options.listen_s, "seconds")
      ->check(CLI::Range(0.01, 3600.0))
      ->capture_default_str();
  app.add_option("--patience", options.patience_s,
                 "seconds more while there are messages but no report")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str();
  return foresight::tool_main(app, argc, argv, [&] { return foresight::listen(options); });
}
