// Which run of a site a process belongs to: what one process leaves for its successor is meant for
// the same run only (docs/decisions/0007).
#pragma once

#include <compare>
#include <cstdint>
#include <iosfwd>
#include <string>

namespace foresight {

/// What tells one run from another: the machine's boot, and the process that started this one
/// (supervisord, a shell) with its start. A new deployment is another run.
struct RunIdentity {
  std::string boot;
  int64_t parent_pid = 0, parent_start = 0;  // start: clock ticks since the boot
  auto operator<=>(const RunIdentity&) const = default;
};
RunIdentity this_run();
/// As two lines of text: "boot …", "parent PID START".
std::ostream& operator<<(std::ostream& out, const RunIdentity& run);
std::istream& operator>>(std::istream& in, RunIdentity& run);

/// Whether the process that started the processes of `run` is still there.
bool goes_on(const RunIdentity& run);

/// $XDG_DATA_HOME/foresight, else ~/.local/share/foresight: a person's data, the same whatever
/// checkout or working directory a process runs in. Empty when there is no home.
std::string user_data_folder();

}  // namespace foresight
