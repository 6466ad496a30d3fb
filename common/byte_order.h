// Numbers as LCM writes them, in messages and in logs: the most significant byte first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace foresight {

/// Of `size` bytes at `bytes`, at most 8.
inline uint64_t read_big_endian(const uint8_t* bytes, size_t size) {
  uint64_t value = 0;
  for (size_t i = 0; i < size; ++i) value = value << 8 | bytes[i];
  return value;
}

inline void append_big_endian(std::vector<uint8_t>* out, uint64_t value, size_t size) {
  for (size_t i = size; i > 0; --i) out->push_back(static_cast<uint8_t>(value >> (8 * (i - 1))));
}

}  // namespace foresight
