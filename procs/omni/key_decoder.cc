#include "procs/omni/key_decoder.h"

#include <cctype>
#include <string_view>

namespace foresight {
namespace {

constexpr uint8_t kEscape = 0x1B;
constexpr Duration kSpacePause = milliseconds(700);
// Per axis: the key that moves it up, the key that moves it down.
constexpr std::array<std::string_view, KeyDecoder::kAxes> kKeys{"ad", "ws", "rf", "tg",
                                                                "yh", "uj", "ik"};

}  // namespace

void KeyDecoder::feed(uint8_t byte, Time now) {
  const char key = static_cast<char>(std::tolower(byte));
  if (byte == kEscape) {
    escape_ = Escape::kBegun;
  } else if (escape_ == Escape::kBegun && (byte == '[' || byte == 'O')) {
    escape_ = Escape::kArrow;
  } else if (escape_ == Escape::kArrow) {
    // Other sequences have digits and semicolons before their last letter.
    if (std::isalpha(byte) != 0 || byte == '~') {
      escape_ = Escape::kNone;
      take_arrow(static_cast<char>(byte), now);
    }
  } else {
    escape_ = Escape::kNone;
    take_key(key, now);
  }
}

void KeyDecoder::take_arrow(char letter, Time now) {
  if (letter == 'A') press(1, 1, now);
  if (letter == 'B') press(1, -1, now);
  if (letter == 'C') press(0, -1, now);
  if (letter == 'D') press(0, 1, now);
}

void KeyDecoder::take_key(char key, Time now) {
  if (key == 'q') quit_ = true;
  if (key == ' ') toggle(now);
  for (int axis = 0; axis < kAxes; ++axis) {
    const size_t place = kKeys[static_cast<size_t>(axis)].find(key);
    if (place != std::string_view::npos) press(axis, place == 0 ? 1 : -1, now);
  }
}

void KeyDecoder::press(int axis, double direction, Time now) {
  held_[static_cast<size_t>(axis)] = {direction, now};
}

void KeyDecoder::toggle(Time now) {
  const bool repeated = last_space_ && now - *last_space_ < kSpacePause;
  last_space_ = now;
  engaged_ = !engaged_ && !repeated;
}

std::vector<double> KeyDecoder::axes(Time now) const {
  std::vector<double> axes;
  for (const Held& key : held_) {
    axes.push_back(now - key.typed < hold_ ? key.direction : 0);
  }
  return axes;
}

}  // namespace foresight
