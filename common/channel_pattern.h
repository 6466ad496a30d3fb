// Which channels a subscription means: one name, or a regular expression (ECMAScript) that matches
// the whole name.
//
//   ChannelPattern("TRUTH_STATE|JOINT_.*").matches("JOINT_STATE")
#pragma once

#include <algorithm>
#include <cctype>
#include <optional>
#include <regex>
#include <string>

#include "common/errors.h"

namespace foresight {

class ChannelPattern {
 public:
  /// Throws UsageError when it is no regular expression.
  explicit ChannelPattern(const std::string& text) : text_(text) {
    const bool is_name = std::all_of(text.begin(), text.end(), [](unsigned char c) {
      return std::isalnum(c) != 0 || c == '_';
    });
    if (is_name) return;
    try {
      expression_.emplace(text, std::regex::optimize);
    } catch (const std::regex_error& e) {
      throw UsageError("channel '" + text + "' is no regular expression: " + e.what());
    }
  }
  bool matches(const std::string& channel) const {
    return expression_ ? std::regex_match(channel, *expression_) : channel == text_;
  }

 private:
  std::string text_;
  std::optional<std::regex> expression_;  // none: the name itself
};

}  // namespace foresight
