#include "common/run_identity.h"

#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>

namespace foresight {
namespace {

// The 22nd word of /proc/PID/stat: when it was started, in clock ticks since the boot.
int64_t start_of(int64_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const size_t name_end = text.rfind(')');  // the name may hold anything
  if (name_end == std::string::npos) return 0;
  std::istringstream words(text.substr(name_end + 1));
  std::string word;
  for (int number = 3; number <= 22 && words >> word; ++number) {
  }
  return std::atoll(word.c_str());
}

std::string this_boot() {
  std::string boot;
  std::ifstream("/proc/sys/kernel/random/boot_id") >> boot;
  return boot.empty() ? "unknown" : boot;
}

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

}  // namespace

RunIdentity this_run() {
  const int64_t parent_pid = getppid();
  return {this_boot(), parent_pid, start_of(parent_pid)};
}

std::ostream& operator<<(std::ostream& out, const RunIdentity& run) {
  return out << "boot " << run.boot << "\nparent " << run.parent_pid << " " << run.parent_start
             << "\n";
}

std::istream& operator>>(std::istream& in, RunIdentity& run) {
  std::string word;
  return in >> word >> run.boot >> word >> run.parent_pid >> run.parent_start;
}

bool goes_on(const RunIdentity& run) {
  return run.boot == this_boot() && run.parent_start == start_of(run.parent_pid);
}

std::string user_data_folder() {
  const std::string data = variable("XDG_DATA_HOME"), home = variable("HOME");
  if (data.starts_with("/")) return data + "/foresight";
  return home.empty() ? "" : home + "/.local/share/foresight";
}

}  // namespace foresight
