// Start-up errors. They carry one line that names the file, key, value and limit and how to mend
// it; the process host prints the line and ends with the exit code. Nothing throws after start-up.
#pragma once

#include <stdexcept>
#include <string>

namespace foresight {

enum ExitCode : int {
  kExitDone = 0,          // done, or stopped by SIGINT/SIGTERM
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
