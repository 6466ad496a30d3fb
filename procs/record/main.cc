// foresight-record: what passes on one LCM domain, into a log; see README.md.
#include <poll.h>
#include <sys/signalfd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <filesystem>

#include "common/lcm_bus.h"
#include "common/lcm_log.h"
#include "common/tool_main.h"

namespace foresight {
namespace {

constexpr int kFlushPeriod_ms = 100;

struct Options {
  std::string url = default_url(Domain::kRobot);
  std::string channel = ".*";
  std::string file;
};

Time wall_clock() {
  const auto since_epoch = std::chrono::system_clock::now().time_since_epoch();
  return {std::chrono::duration_cast<std::chrono::microseconds>(since_epoch).count()};
}

// Readable when the recording is told to end: Ctrl-C, a script, a terminal that closes. Before any
// thread begins, so that no other one takes the signal.
int end_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, number);
  sigprocmask(SIG_BLOCK, &signals, nullptr);
  std::signal(SIGXFSZ, SIG_IGN);  // a limit of the file's size is an error like a full disk
  return signalfd(-1, &signals, SFD_CLOEXEC);
}

int record(const Options& options) {
  const int end = end_signals();
  std::error_code ignored;  // what cannot be looked at cannot be written either
  if (std::filesystem::is_regular_file(options.file, ignored)) {
    throw UsageError(options.file + ": exists; a recording replaces nothing");
  }
  LcmBus bus(options.url);
  LogWriter log(options.file, LogPlacement::kAtOnce);
  bus.subscribe(options.channel, [&](const std::string& channel, auto bytes) {
    log.write(wall_clock(), channel, bytes);
  });
  std::array<pollfd, 2> files = {pollfd{bus.file_descriptor(), POLLIN, 0}, pollfd{end, POLLIN, 0}};
  auto flushed = std::chrono::steady_clock::now();
  while ((files[1].revents & POLLIN) == 0 && !log.has_failed()) {
    poll(files.data(), files.size(), kFlushPeriod_ms);
    bus.receive();
    const auto now = std::chrono::steady_clock::now();
    if (now - flushed < std::chrono::milliseconds(kFlushPeriod_ms)) continue;
    log.flush();
    flushed = now;
  }
  log.close();
  return kExitDone;
}

}  // namespace
}  // namespace foresight

int main(int argc, char** argv) {
  foresight::Options options;
  CLI::App app("Records what passes on an LCM domain, until SIGINT, SIGTERM or SIGHUP.",
               "foresight-record");
  app.add_option("--url", options.url, "LCM URL")->capture_default_str();
  app.add_option("--channel", options.channel, "only channels that match as a whole")
      ->capture_default_str();
  app.add_option("log", options.file, "a new file")->required();
  return foresight::tool_main(app, argc, argv, [&] { return foresight::record(options); });
}
