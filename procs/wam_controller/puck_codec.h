// Frames of the WAM's motor controllers ("pucks") and its safety board on the CAN bus.
//
//   bus.send(get_frame(group_address(kGroupAll), kPropertyPosition));
//   if (auto feedback = read_feedback(frame)) … feedback->node, property, value
//
// Source: Barrett, WAM Arm User's Manual D1001, chapter 7. 1 Mbit/s, 11-bit ids GFFFFFTTTTT: group
// flag, sender, receiver or group. A frame's first byte is the property (7 bits) and the flag that
// sets it; a value follows after an empty byte, lowest byte first. Positions come as bare 22-bit
// numbers in 3 bytes to group 3, highest first; torques go as four 14-bit numbers after the first
// byte. No allocation, no exceptions.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

namespace foresight {

struct CanFrame {
  uint16_t id = 0;  // 11 bits
  uint8_t size = 0;
  std::array<uint8_t, 8> data{};
  bool operator==(const CanFrame&) const = default;
};

constexpr int kNodeHost = 0;
constexpr int kNodeSafetyBoard = 10;
constexpr int kMaxNode = 31;

constexpr int kGroupAll = 0;
constexpr int kGroupLowerTorques = 1;  // nodes 1 to 4
constexpr int kGroupUpperTorques = 2;  // nodes 5 to 7
constexpr int kGroupPositions = 3;     // feedback
constexpr int kGroupProperties = 6;    // feedback
constexpr int kTorquesPerFrame = 4;

constexpr uint8_t kPropertyStatus = 5;
constexpr uint8_t kPropertyMode = 8;
constexpr uint8_t kPropertyTorque = 42;
constexpr uint8_t kPropertyPosition = 48;
constexpr int32_t kStatusReady = 2;

/// Id of a frame from the host to one node, or to a group.
uint16_t node_address(int node);
uint16_t group_address(int group);

CanFrame get_frame(uint16_t address, uint8_t property);
CanFrame set_frame(uint16_t address, uint8_t property, int32_t value);
/// Torques in the pucks' unit, limited to 14 bits (±8191). `group`: one of the torque groups.
CanFrame torque_frame(int group, std::span<const int32_t, kTorquesPerFrame> torques);

/// What a node tells the host.
struct Feedback {
  int node = 0;
  uint8_t property = 0;
  int32_t value = 0;
};
/// Nothing for frames that are not feedback or do not have its form.
std::optional<Feedback> read_feedback(const CanFrame& frame);

}  // namespace foresight
