// The main() of a command-line tool (not of a process: process_main.h): parses, runs, and turns
// errors into one line and an exit code.
//
//   CLI::App app("Does this.", "tool-name");
//   app.add_option(…);
//   return tool_main(app, argc, argv, [&] { return work(options); });
#pragma once

#include <CLI/CLI.hpp>
#include <cstdio>

#include "common/errors.h"

namespace foresight {

template <class Run>
int tool_main(CLI::App& app, int argc, char** argv, const Run& run) {
  try {
    app.parse(argc, argv);
    return run();
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "%s: %s (see --help)\n", app.get_name().c_str(), error.what());
    return kExitUsage;
  } catch (const StartupError& error) {
    std::fprintf(stderr, "%s: %s\n", app.get_name().c_str(), error.what());
    return error.code();
  }
}

}  // namespace foresight
