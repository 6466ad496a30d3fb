#include "common/text_lines.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>

#include "common/errors.h"

namespace foresight {
namespace {

constexpr std::string_view kBlank = " \t\r\f\v";
constexpr std::string_view kSeparator = " \t,;";
constexpr double kMaxTime_s = 1e11;  // beyond that microseconds are not exact

std::string_view trimmed(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(kBlank), text.size()));
  return text.substr(0, text.find_last_not_of(kBlank) + 1);
}

void drop_mark(const std::string& path, std::string* first_line) {
  if (first_line->starts_with("\xEF\xBB\xBF")) first_line->erase(0, 3);
  if (first_line->starts_with("\xFF\xFE") || first_line->starts_with("\xFE\xFF")) {
    throw ConfigError(path + ": is UTF-16 text: save it as UTF-8");
  }
}

// Whole numbers too large for seconds.
std::optional<Time> whole_stamp(int64_t count) {
  if (count < static_cast<int64_t>(1e14)) return Time{count * 1000};  // milliseconds
  if (count < static_cast<int64_t>(1e17)) return Time{count};         // microseconds
  return Time{count / 1000};                                          // nanoseconds
}

}  // namespace

std::vector<TextLine> data_lines(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw UnavailableError(path + ": cannot be read");
  std::vector<TextLine> lines;
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    if (++number == 1) drop_mark(path, &line);
    const std::string_view text = trimmed(line);
    if (!text.empty() && text.front() != '#') lines.push_back({number, std::string(text)});
  }
  if (file.bad()) throw UnavailableError(path + ": cannot be read");  // such as a folder
  return lines;
}

std::string_view take_word(std::string_view* text) {
  const std::string_view word = text->substr(0, text->find_first_of(kSeparator));
  text->remove_prefix(word.size());
  text->remove_prefix(std::min(text->find_first_not_of(kBlank), text->size()));
  if (!text->empty() && (text->front() == ',' || text->front() == ';')) text->remove_prefix(1);
  *text = trimmed(*text);
  return word;
}

std::optional<Time> parse_stamp(std::string_view word) {
  const char* const last = word.data() + word.size();
  int64_t count = 0;
  const auto [whole_end, whole_error] = std::from_chars(word.data(), last, count);
  if (whole_error == std::errc() && whole_end == last &&
      count >= static_cast<int64_t>(kMaxTime_s)) {
    return whole_stamp(count);
  }
  double stamp_s = 0;
  const auto [end, error] = std::from_chars(word.data(), last, stamp_s);
  if (error != std::errc() || end != last || !(std::abs(stamp_s) < kMaxTime_s)) {
    return std::nullopt;
  }
  return Time{} + seconds(stamp_s);
}

}  // namespace foresight
