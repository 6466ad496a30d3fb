#include "procs/omni/joystick_decoder.h"

#include <algorithm>
#include <cmath>

namespace foresight {
namespace {

constexpr size_t kEventBytes = 8;
constexpr uint8_t kButton = 0x01, kAxis = 0x02, kInitial = 0x80;
constexpr double kFullScale = 32767;

}  // namespace

void JoystickDecoder::feed(std::span<const uint8_t> bytes) {
  for (const uint8_t byte : bytes) {
    event_.push_back(byte);
    if (event_.size() == kEventBytes) take_event();
  }
}

void JoystickDecoder::take_event() {
  const auto value = static_cast<int16_t>(event_[4] | event_[5] << 8);
  const uint8_t type = event_[6] & static_cast<uint8_t>(~kInitial);
  const size_t number = event_[7];
  event_.clear();
  if (type == kAxis) {
    if (number >= axes_.size()) {
      axes_.resize(number + 1, 0);
      reported_.resize(number + 1, false);
    }
    reported_[number] = true;
    axes_[number] = std::max(-1.0, value / kFullScale);
  } else if (type == kButton) {
    if (number >= buttons_.size()) buttons_.resize(number + 1, 0);
    buttons_[number] = value != 0 ? 1 : 0;
  }
}

double without_dead_zone(double deflection, double dead_zone) {
  const double size = (std::abs(deflection) - dead_zone) / (1 - dead_zone);
  return size <= 0 ? 0 : std::copysign(std::min(size, 1.0), deflection);
}

}  // namespace foresight
