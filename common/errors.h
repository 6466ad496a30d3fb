// Errors that a person can mend. They carry one line that names the file, key, value and limit and
// how to mend it; the process host and the tools print the line and end with the exit code. After a
// process has started they are thrown only to be caught where a file or device is used.
#pragma once

#include <stdexcept>
#include <string>

namespace foresight {

enum ExitCode : int {
  kExitDone = 0,          // done, or stopped by SIGINT/SIGTERM
  kExitFault = 1,         // a test or a fuzzer found a fault
  kExitUsage = 64,        // command line
  kExitUnavailable = 69,  // bus, device or file that cannot be opened
  kExitBug = 70,          // broken invariant
  kExitConfig = 78,       // parameters, camera file, site file
};

class StartupError : public std::runtime_error {
 public:
  StartupError(ExitCode code, const std::string& line) : std::runtime_error(line), code_(code) {}
  ExitCode code() const { return code_; }

 private:
  ExitCode code_;
};

struct UsageError : StartupError {
  explicit UsageError(const std::string& line) : StartupError(kExitUsage, line) {}
};
struct UnavailableError : StartupError {
  explicit UnavailableError(const std::string& line) : StartupError(kExitUnavailable, line) {}
};
struct ConfigError : StartupError {
  explicit ConfigError(const std::string& line) : StartupError(kExitConfig, line) {}
};

}  // namespace foresight
