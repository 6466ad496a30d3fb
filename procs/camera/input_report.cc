#include "procs/camera/input_report.h"

#include <algorithm>

namespace foresight {
namespace {

constexpr size_t kNamed = 3;      // refused images
constexpr size_t kMaxKinds = 20;  // of oddities

}  // namespace

void InputReport::refuse(const std::string& name, const std::string& why) {
  ++refused_;
  if (refusals_.size() < kNamed) refusals_.push_back(name + ": " + why);
}

void InputReport::warn(const std::string& name, const std::string& what) {
  if (!oddities_.contains(what) && oddities_.size() >= kMaxKinds) return;
  Oddity& oddity = oddities_[what];
  if (oddity.images++ == 0) oddity.first = name;
}

void InputReport::note(const std::string& what) {
  if (!what.empty() && std::find(notes_.begin(), notes_.end(), what) == notes_.end()) {
    notes_.push_back(what);
  }
}

std::string InputReport::complaint() const {
  if (complete()) return "";
  std::string text;
  if (refused_ > 0 || used_ == 0) {
    text = std::to_string(refused_) + " of " + std::to_string(used_ + refused_) +
           " images could not be used";
    for (size_t i = 0; i < refusals_.size(); ++i) text += (i == 0 ? ": " : "; ") + refusals_[i];
    if (refusals_.size() < static_cast<size_t>(refused_)) text += "; …";
  }
  if (!shortfall_.empty()) text += (text.empty() ? "" : "; ") + shortfall_;
  return text;
}

std::vector<std::string> InputReport::lines() const {
  std::vector<std::string> lines = notes_;
  for (const auto& [what, oddity] : oddities_) {
    lines.push_back(std::to_string(oddity.images) + " of " + std::to_string(used_) +
                    " images: " + what + " (first: " + oddity.first + ")");
  }
  if (!complete()) lines.push_back(complaint());
  return lines;
}

}  // namespace foresight
