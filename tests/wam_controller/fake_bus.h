// A CAN bus with pucks and a safety board on it, as far as the controller asks them.
#pragma once

#include <array>

#include "procs/wam_controller/can_bus.h"

namespace foresight {

class FakeBus : public CanBus {
 public:
  bool send(const CanFrame& frame) override {
    if (is_broken) return false;
    ++sent;
    last_sent = frame;
    if (frame == get_frame(group_address(kGroupAll), kPropertyPosition)) answer_positions();
    if (frame == get_frame(node_address(kNodeSafetyBoard), kPropertyMode) && has_board) {
      push({static_cast<uint16_t>(0x400 | kNodeSafetyBoard << 5 | kGroupProperties),
            4,
            {kPropertyMode | 0x80, 0, mode}});
    }
    for (int node = 1; node <= node_count; ++node) {
      if (frame == get_frame(node_address(node), kPropertyStatus) && node != silent_node) {
        push({static_cast<uint16_t>(0x400 | node << 5 | kGroupProperties),
              4,
              {kPropertyStatus | 0x80, 0, status[static_cast<size_t>(node)]}});
      }
    }
    if (frame == set_frame(group_address(kGroupAll), kPropertyStatus, kStatusReady)) {
      status.fill(kStatusReady);
    }
    if (frame.size == 8) torques[frame.id & 31] = frame;
    return true;
  }
  bool receive(Duration, CanFrame* frame) override {
    if (head_ == tail_) return false;
    *frame = queue_[head_++ % queue_.size()];
    return true;
  }
  void push(const CanFrame& frame) { queue_[tail_++ % queue_.size()] = frame; }
  void answer_positions() {
    for (int node = 1; node <= node_count; ++node) {
      if (node == silent_node) continue;
      const auto raw = static_cast<uint32_t>(positions[static_cast<size_t>(node)]) & 0x3FFFFF;
      push({static_cast<uint16_t>(0x400 | node << 5 | kGroupPositions),
            3,
            {static_cast<uint8_t>(raw >> 16), static_cast<uint8_t>(raw >> 8),
             static_cast<uint8_t>(raw)}});
    }
  }

  int node_count = 4, silent_node = 0, sent = 0;
  bool is_broken = false, has_board = true;
  uint8_t mode = 2;
  std::array<int32_t, 8> positions{};
  std::array<uint8_t, 8> status{};  // 0: switched on, and not woken since
  /// As when the power goes and comes back: the pucks count from here.
  void switch_off_and_on() {
    status = {};
    positions = {};
  }
  CanFrame last_sent;
  std::array<CanFrame, 32> torques;  // by group

 private:
  std::array<CanFrame, 64> queue_;  // does not allocate, for the guard test
  size_t head_ = 0, tail_ = 0;
};

}  // namespace foresight
