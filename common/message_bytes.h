// A message as the bytes of its datagram, and back.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/check.h"

namespace foresight {

template <class Message>
std::vector<uint8_t> encode(const Message& message) {
  std::vector<uint8_t> bytes(message.getEncodedSize());
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

/// Of bytes that are such a message: what a process of ours has published. What comes from a
/// network or a file goes through decode_checked() (message_check.h).
template <class Message>
Message decode(std::span<const uint8_t> bytes) {
  Message message;
  FORESIGHT_CHECK(message.decode(bytes.data(), 0, static_cast<int>(bytes.size())) >= 0);
  return message;
}

}  // namespace foresight
