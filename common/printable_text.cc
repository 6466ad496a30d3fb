#include "common/printable_text.h"

#include <cstdint>

namespace foresight {
namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";  // U+FFFD
constexpr std::string_view kEllipsis = "\xE2\x80\xA6";

struct Character {
  size_t size = 1;
  bool is_valid = false;
  uint32_t code = 0;
};

// The longest well-formed sequence at the beginning (Unicode 15, table 3-7), or one bad byte.
Character first_character(std::string_view text) {
  const auto byte = [&](size_t i) { return static_cast<uint8_t>(text[i]); };
  const uint8_t lead = byte(0);
  if (lead < 0x80) return {1, true, lead};
  const size_t size = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || text.size() < size) return {};
  uint32_t code = lead & (0x7Fu >> size);
  for (size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return {};
    code = code << 6 | (byte(i) & 0x3Fu);
  }
  const uint32_t least = size == 4 ? 0x10000 : size == 3 ? 0x800 : 0x80;
  const bool is_surrogate = code >= 0xD800 && code <= 0xDFFF;
  if (code < least || code > 0x10FFFF || is_surrogate) return {};
  return {size, true, code};
}

bool is_control(uint32_t code) {
  const bool separates_lines = code == 0x2028 || code == 0x2029;
  return code < 0x20 || (code >= 0x7F && code < 0xA0) || separates_lines;
}

}  // namespace

std::string printable(std::string_view text, size_t max_bytes) {
  std::string out;
  while (!text.empty()) {
    const Character c = first_character(text);
    const std::string_view as = !c.is_valid          ? kReplacement
                                : is_control(c.code) ? std::string_view(" ")
                                                     : text.substr(0, c.size);
    const size_t rest = text.size() > c.size ? kEllipsis.size() : 0;
    if (out.size() + as.size() + rest > max_bytes) return out.append(kEllipsis);
    out += as;
    text.remove_prefix(c.size);
  }
  return out;
}

}  // namespace foresight
