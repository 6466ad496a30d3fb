// Files that a tool writes at the end of a long run: checked before it, written in full or named.
//
//   check_output("--json", json_path);                      // before the run
//   check_output("--grid", grid_path, kPictureExtensions);
//   …
//   std::printf(…);                                         // the figures, before anything can
//   fail RunErrors errors; errors.attempt([&] { write_output(json_path, text); });  // one that
//   fails does not stop the next errors.attempt([&] { write_output(grid_path, png_bytes); });
//   errors.report();
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/errors.h"

namespace foresight {

/// Of pictures that tools draw.
inline const std::vector<std::string_view> kPictureExtensions = {".png", ".jpg", ".jpeg"};

/// Throws UsageError unless the name ends with one of `extensions` (any, if there are none), and
/// UnavailableError unless a file can be made or replaced there. An empty path is no output. What
/// is there stays as it is.
void check_output(const std::string& option, const std::string& path,
                  const std::vector<std::string_view>& extensions = {});

/// Makes the folder where it is missing; throws UnavailableError unless files can be made in it.
void check_output_folder(const std::string& option, const std::string& folder);

/// Writes a whole file. Throws UnavailableError with path and reason, a full disk included.
void write_output(const std::string& path, std::string_view text);
void write_output(const std::string& path, std::span<const unsigned char> bytes);

/// The same, beside it and renamed: whoever reads it, or finds it after this process was killed,
/// has the earlier file or this one, whole. For the process's death, not the machine's: nothing is
/// flushed.
void replace_output(const std::string& path, std::string_view text);

/// A string as JSON has it, quotes included.
std::string json_text(std::string_view text);

/// Errors of several steps, none of which is to stop the others: sequences, outputs.
class RunErrors {
 public:
  /// Runs it; what it throws of StartupError is kept.
  void attempt(const std::function<void()>& step);
  /// Something that is missing though there are results.
  void add(const std::string& line);
  /// All lines, one below the other; empty: none.
  const std::string& text() const { return text_; }
  /// Throws them as one: all lines, one below the other, and the first one's exit code.
  void report() const;

 private:
  std::string text_;
  ExitCode code_ = kExitDone;
};

}  // namespace foresight
