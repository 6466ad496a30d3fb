// foresight-play: a log into one LCM domain, at its own pace; see README.md.
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <regex>

#include "common/lcm_bus.h"
#include "common/lcm_log.h"
#include "common/log_timeline.h"
#include "common/tool_main.h"

namespace foresight {
namespace {

using Clock = std::chrono::steady_clock;

struct Options {
  std::string url = default_url(Domain::kRobot);
  std::string channel = ".*";
  std::string file;
  double speed = 1;
};

std::regex read_pattern(const std::string& text) {
  try {
    return std::regex(text);
  } catch (const std::regex_error&) {
    throw UsageError("--channel " + text + ": is not a regular expression");
  }
}

void wait_until(Clock::time_point due) {
  const timespec whole_second{1, 0};
  for (auto now = Clock::now(); now < due; now = Clock::now()) {
    const auto left = std::chrono::duration_cast<std::chrono::nanoseconds>(due - now).count();
    const timespec rest{0, left};
    ppoll(nullptr, 0, left >= 1'000'000'000 ? &whole_second : &rest, nullptr);
  }
}

int play(const Options& options) {
  const std::regex pattern = read_pattern(options.channel);
  LogReader log(options.file);
  std::vector<LogReader::Entry> entries;
  std::vector<Time> stamps;
  while (const auto entry = log.next_entry()) {
    entries.push_back(*entry);
    stamps.push_back(entry->time);
  }
  const LogTimeline timeline = make_timeline(stamps);
  LcmBus bus(options.url);
  const auto begin = Clock::now();
  for (size_t i = 0; i < entries.size(); ++i) {
    const LogEvent event = log.event(entries[timeline.order[i]]);
    if (!std::regex_match(event.channel, pattern)) continue;
    const double due_s = (timeline.times[i] - timeline.times[0]).seconds() / options.speed;
    wait_until(begin + std::chrono::duration_cast<Clock::duration>(
                           std::chrono::duration<double>(std::max(0.0, due_s))));
    bus.publish(event.channel, event.bytes);
  }
  if (const std::string stamped = timeline.remark(); !stamped.empty()) {
    std::cerr << "foresight-play: " << options.file << ": " << stamped << "\n";
  }
  log.require_whole();
  return timeline.is_out_of_order() ? kExitUnavailable : kExitDone;
}

}  // namespace
}  // namespace foresight

int main(int argc, char** argv) {
  foresight::Options options;
  CLI::App app("Plays a log into an LCM domain, at its own pace.", "foresight-play");
  app.add_option("--url", options.url, "LCM URL")->capture_default_str();
  app.add_option("--speed", options.speed, "factor")
      ->check(CLI::Range(0.001, 1000.0))
      ->capture_default_str();
  app.add_option("--channel", options.channel, "only channels that match as a whole")
      ->capture_default_str();
  app.add_option("log", options.file, "made by scripts/record, lcm-logger or --output")->required();
  return foresight::tool_main(app, argc, argv, [&] { return foresight::play(options); });
}
