#include "procs/wam_controller/puck_codec.h"

#include <algorithm>

namespace foresight {
namespace {

constexpr uint16_t kGroupFlag = 0x400;
constexpr uint8_t kSetFlag = 0x80;
constexpr int32_t kLargestTorque = 8191;

// The lowest `bits` of `raw` as a signed number.
int32_t sign_extend(uint32_t raw, int bits) {
  const uint32_t sign = 1u << (bits - 1);
  const uint32_t low = raw & ((sign << 1) - 1);
  return static_cast<int32_t>((low ^ sign) - sign);
}

std::optional<Feedback> read_position(int node, const CanFrame& frame) {
  if (frame.size < 3) return std::nullopt;
  const uint32_t raw = static_cast<uint32_t>(frame.data[0]) << 16 |
                       static_cast<uint32_t>(frame.data[1]) << 8 | frame.data[2];
  return Feedback{node, kPropertyPosition, sign_extend(raw, 22)};
}

std::optional<Feedback> read_property(int node, const CanFrame& frame) {
  if (frame.size != 4 && frame.size != 6) return std::nullopt;
  uint32_t raw = 0;
  for (size_t i = frame.size; i-- > 2;) raw = raw << 8 | frame.data[i];
  const auto property = static_cast<uint8_t>(frame.data[0] & ~kSetFlag);
  const int32_t value = frame.size == 4 ? sign_extend(raw, 16) : static_cast<int32_t>(raw);
  return Feedback{node, property, value};
}

}  // namespace

uint16_t node_address(int node) { return static_cast<uint16_t>(node & kMaxNode); }
uint16_t group_address(int group) { return static_cast<uint16_t>(kGroupFlag | (group & kMaxNode)); }

CanFrame get_frame(uint16_t address, uint8_t property) {
  return {address, 1, {static_cast<uint8_t>(property & ~kSetFlag)}};
}

CanFrame set_frame(uint16_t address, uint8_t property, int32_t value) {
  CanFrame frame{address, 6, {static_cast<uint8_t>(property | kSetFlag), 0}};
  const auto raw = static_cast<uint32_t>(value);
  for (size_t i = 0; i < 4; ++i) frame.data[2 + i] = static_cast<uint8_t>(raw >> (8 * i));
  return frame;
}

CanFrame torque_frame(int group, std::span<const int32_t, kTorquesPerFrame> torques) {
  CanFrame frame{group_address(group), 8, {kPropertyTorque | kSetFlag}};
  uint64_t bits = 0;
  for (const int32_t torque : torques) {
    const int32_t limited = std::clamp(torque, -kLargestTorque, kLargestTorque);
    bits = bits << 14 | (static_cast<uint32_t>(limited) & 0x3FFF);
  }
  for (size_t i = 0; i < 7; ++i) frame.data[1 + i] = static_cast<uint8_t>(bits >> (8 * (6 - i)));
  return frame;
}

std::optional<Feedback> read_feedback(const CanFrame& frame) {
  const int node = frame.id >> 5 & kMaxNode;
  if (node == kNodeHost || frame.size > frame.data.size()) return std::nullopt;
  if (frame.id == (group_address(kGroupPositions) | node << 5)) return read_position(node, frame);
  const bool is_to_host = frame.id == (node_address(kNodeHost) | node << 5);
  const bool is_to_group = frame.id == (group_address(kGroupProperties) | node << 5);
  if (is_to_host || is_to_group) return read_property(node, frame);
  return std::nullopt;
}

}  // namespace foresight
