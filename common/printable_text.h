// Text that may come from anywhere (a network, a file name, a device) made fit to be published,
// shown in a terminal and read as JSON.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace foresight {

/// Valid UTF-8 of one line: control characters become blanks, bytes that are no UTF-8 become
/// U+FFFD, and what exceeds `max_bytes` is cut at a character's border and ends in "…".
std::string printable(std::string_view text, size_t max_bytes = 1000);

}  // namespace foresight
