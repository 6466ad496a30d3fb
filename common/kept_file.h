// A small text that a running process keeps on the disk, so that it outlives the process: after a
// crash or a SIGKILL the next one of the same run goes on with it (docs/decisions/0007). One file
// per process and run.
//
//   KeptFile kept(folder, node.name(), this_run());
//   kept.remove_those_of_ended_runs();
//   if (const auto text = kept.read(&trouble)) …;   // at the start: what to go on with
//   kept.write(text);                               // now and then; may block on a slow disk
//   kept.remove();                                  // ended on purpose: nobody is to go on
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/run_identity.h"

namespace foresight {

class KeptFile {
 public:
  /// Starts that one text is good for: then it may be the reason why they end.
  static constexpr int kMostReads = 3;

  /// `name`: the process's own, so that two of one run do not share a file.
  KeptFile(const std::string& folder, const std::string& name, const RunIdentity& run);
  const std::string& path() const { return path_; }

  /// What an earlier process of this run has left; counts the reading. Nothing if there is none or
  /// it cannot be used; then `trouble` is why, as one line, or empty.
  std::optional<std::string> read(std::string* trouble);
  /// Replaces what is there, all or nothing. Throws UnavailableError.
  void write(std::string_view text) const;
  void remove() const;
  /// Removes what the same process has left in runs that are over.
  void remove_those_of_ended_runs() const;

 private:
  void write(std::string_view text, int reads) const;

  std::string folder_, prefix_, path_;
  RunIdentity run_;
};

}  // namespace foresight
