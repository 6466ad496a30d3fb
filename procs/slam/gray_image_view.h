// A borrowed 8-bit gray image: row-major, `stride_bytes` from row to row. The caller keeps the
// pixels alive for the duration of the call it passes the view to.
#pragma once

#include <cstdint>

namespace foresight {

struct GrayImageView {
  const uint8_t* pixels = nullptr;
  int width_px = 0;
  int height_px = 0;
  int stride_bytes = 0;
};

}  // namespace foresight
