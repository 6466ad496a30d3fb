// An image in memory: 8-bit gray or RGB, rows from the top, no
// padding. Pixel (0, 0) is the first byte.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace foresight {

struct Image {
  int width_px = 0;
  int height_px = 0;
  int channels = 0;  // 1 gray, 3 RGB
  std::vector<uint8_t> bytes;

  /// Size within limits (16384 px a side), gray or RGB, and exactly the bytes that the size asks
  /// for.
  bool is_valid() const {
    constexpr int kMaxSide_px = 16384;
    if (width_px <= 0 || height_px <= 0 || width_px > kMaxSide_px || height_px > kMaxSide_px) {
      return false;
    }
    if (channels != 1 && channels != 3) return false;
    return bytes.size() == static_cast<size_t>(width_px) * height_px * channels;
  }
};

}  // namespace foresight
