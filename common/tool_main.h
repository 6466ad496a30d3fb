// The main() of a command-line tool (not of a process: process_main.h): parses, runs, and turns
// errors into one line and an exit code.
//
//   CLI::App app("Does this.", "tool-name");
//   app.add_option(…);
//   return tool_main(app, argc, argv, [&] { return work(options); });
#pragma once

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <exception>
#include <string>

#include "common/errors.h"

namespace foresight {

template <class Run>
int tool_main(CLI::App& app, int argc, char** argv, const Run& run) {
  try {
    app.parse(argc, argv);
    const int code = run();
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
    throw UnavailableError(std::string("standard output cannot be written: ") +
                           std::strerror(errno));
  } catch (const CLI::CallForHelp& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "%s: %s (see --help)\n", app.get_name().c_str(), error.what());
    return kExitUsage;
  } catch (const StartupError& error) {
    std::fprintf(stderr, "%s: %s\n", app.get_name().c_str(), error.what());
    return error.code();
  } catch (const std::exception& error) {  // what was printed so far is still to come out
    std::fprintf(stderr, "%s: fault in the program: %s\n", app.get_name().c_str(), error.what());
    return kExitBug;
  }
}

}  // namespace foresight
