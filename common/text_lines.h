// Lines of text files that describe recordings (rgb.txt, groundtruth.txt), as people's tools write
// them.
//
//   for (const TextLine& line : data_lines("rgb.txt")) {
//     std::string_view rest = line.text;
//     const std::optional<Time> time = parse_stamp(take_word(&rest));
//     …
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/time.h"

namespace foresight {

struct TextLine {
  int number = 0;    // from 1
  std::string text;  // without blanks at its ends
};

/// The lines that hold data. Passed over: a byte-order mark, carriage returns, lines of blanks,
/// lines that begin with #. Throws UnavailableError where the file cannot be read, ConfigError
/// where it is not text of 8-bit characters (UTF-16).
std::vector<TextLine> data_lines(const std::string& path);

/// Takes the first word off; it ends at blanks, a comma or a semicolon.
std::string_view take_word(std::string_view* text);

/// A time-stamp in seconds; or a whole number too large for seconds, which then counts
/// milliseconds (13 digits), microseconds (16) or nanoseconds (19). Nothing when it is no number,
/// not finite or too large.
std::optional<Time> parse_stamp(std::string_view word);

}  // namespace foresight
