// log-text: an LCM log of ours as text, one line a field.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <iostream>

#include "common/errors.h"
#include "common/lcm_log.h"
#include "common/message_text.h"

namespace foresight {
namespace {

int print_log(const std::string& path, const std::vector<std::string>& channels) {
  LogReader log(path);
  while (const auto event = log.next()) {
    const bool wanted = channels.empty() || std::find(channels.begin(), channels.end(),
                                                      event->channel) != channels.end();
    if (!wanted) continue;
    const MessageSchema* schema = identify_message(event->bytes);
    const std::string error =
        schema == nullptr ? "unknown type" : find_layout_error(*schema, event->bytes);
    std::printf("%lld %s %s\n", static_cast<long long>(event->time.us), event->channel.c_str(),
                error.empty() ? schema->name : error.c_str());
    if (!error.empty()) continue;
    for (const MessageField& f : message_fields(*schema, event->bytes)) {
      std::printf("  %s: %s\n", f.path.c_str(), f.value.c_str());
    }
  }
  std::fflush(stdout);
  log.require_whole();
  return kExitDone;
}

}  // namespace
}  // namespace foresight

int main(int argc, char** argv) {
  CLI::App app("Prints an LCM log: time, channel and type of each message, then its fields.",
               "log-text");
  std::string path;
  std::vector<std::string> channels;
  app.add_option("log", path, "made by lcm-logger or --output")->required();
  app.add_option("--channel", channels, "only these (repeatable)");
  try {
    app.parse(argc, argv);
    return foresight::print_log(path, channels);
  } catch (const CLI::CallForHelp& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    std::cerr << "log-text: " << e.what() << " (see --help)\n";
    return foresight::kExitUsage;
  } catch (const foresight::StartupError& e) {
    std::cerr << "log-text: " << e.what() << "\n";
    return e.code();
  }
}
