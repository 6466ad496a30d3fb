#include "procs/omni/motion.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "common/check.h"
#include "common/errors.h"

namespace foresight {
namespace {

constexpr size_t kMaxJointColumns = 16;
constexpr size_t kMaxSamples = 2'000'000;
constexpr double kMaxAngle_rad = 20;

using Words = std::vector<std::string_view>;

Words split(std::string_view line) {
  constexpr std::string_view kSeparators = ", \t\r";
  Words words;
  while (true) {
    const size_t begin = line.find_first_not_of(kSeparators);
    if (begin == std::string_view::npos) return words;
    const size_t end = std::min(line.find_first_of(kSeparators, begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    line.remove_prefix(end);
  }
}

class TableParser {
 public:
  explicit TableParser(const std::string& name) : name_(name) {}

  void take_line(std::string_view line) {
    ++line_;
    const Words words = split(line);
    if (words.empty() || words[0].front() == '#') return;
    if (columns_ == 0) {
      take_names(words);
    } else {
      take_numbers(words);
    }
  }
  std::vector<MotionSample> finish() {
    if (samples_.empty()) throw ConfigError(name_ + ": has no samples");
    return std::move(samples_);
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw ConfigError(name_ + ":" + std::to_string(line_) + ": " + what);
  }
  void take_names(const Words& words) {
    has_engaged_ = words.size() > 1 && words[1] == "engaged";
    columns_ = words.size();
    const size_t first_joint = has_engaged_ ? 2 : 1;
    if (words[0] != "time_s" || columns_ <= first_joint ||
        columns_ - first_joint > kMaxJointColumns) {
      refuse("must name the columns: time_s, perhaps engaged, then 1 to 16 joints");
    }
  }
  double number(std::string_view word) const {
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) {
      refuse("'" + std::string(word) + "' is not a number");
    }
    return value;
  }
  void take_numbers(const Words& words) {
    if (words.size() != columns_) {
      refuse("has " + std::to_string(words.size()) + " columns, not " + std::to_string(columns_));
    }
    if (samples_.size() >= kMaxSamples) refuse("too many samples");
    MotionSample sample;
    sample.time_s = number(words[0]);
    if (!samples_.empty() && !(sample.time_s > samples_.back().time_s)) {
      refuse("time_s must increase");
    }
    if (has_engaged_) sample.engaged = number(words[1]) != 0;
    for (size_t i = has_engaged_ ? 2 : 1; i < columns_; ++i) {
      sample.position_rad.push_back(number(words[i]));
      if (std::abs(sample.position_rad.back()) > kMaxAngle_rad) refuse("a joint beyond 20 rad");
    }
    samples_.push_back(std::move(sample));
  }

  const std::string& name_;
  int line_ = 0;
  size_t columns_ = 0;
  bool has_engaged_ = false;
  std::vector<MotionSample> samples_;
};

}  // namespace

Motion::Motion(std::vector<MotionSample> samples, MotionStyle style)
    : samples_(std::move(samples)), style_(style) {
  FORESIGHT_CHECK(!samples_.empty());
}

MotionSample Motion::at(double time_s) const {
  const auto next =
      std::upper_bound(samples_.begin(), samples_.end(), time_s,
                       [](double time, const MotionSample& s) { return time < s.time_s; });
  if (next == samples_.begin()) return samples_.front();
  if (next == samples_.end()) return samples_.back();
  const MotionSample& last = *(next - 1);
  const double u = (time_s - last.time_s) / (next->time_s - last.time_s);
  const double share = style_ == MotionStyle::kLinear ? u : u * u * u * (10 + u * (6 * u - 15));
  MotionSample sample{time_s, last.engaged, last.position_rad};
  for (size_t i = 0; i < sample.position_rad.size(); ++i) {
    sample.position_rad[i] += share * (next->position_rad[i] - last.position_rad[i]);
  }
  return sample;
}

std::vector<MotionSample> parse_motion_table(std::string_view text, const std::string& name) {
  TableParser parser(name);
  while (!text.empty()) {
    const size_t end = std::min(text.find('\n'), text.size());
    parser.take_line(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return parser.finish();
}

}  // namespace foresight
