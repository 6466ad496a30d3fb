// image_t to pixels and back (JPEG by libturbojpeg). Sizes are checked against the message's and
// against kMaxPixels before anything is allocated.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "foresight/image_t.hpp"

namespace foresight {

/// Rows without padding; channels 1 (gray) or 3 (RGB).
struct PixelImage {
  int width_px = 0;
  int height_px = 0;
  int channels = 0;
  std::vector<uint8_t> pixels;
  bool empty() const { return pixels.empty(); }
};

constexpr int64_t kMaxPixels = 8192LL * 8192;

/// Decodes to 1 or 3 channels; nothing when the data is damaged or contradicts the message's size.
std::optional<PixelImage> decode_image(const image_t& message, int channels);

/// Fills width, height, encoding and data. `quality` 1…100.
void encode_jpeg(const PixelImage& image, int quality, image_t* message);
/// Uncompressed GRAY8 or RGB8.
void encode_raw(const PixelImage& image, image_t* message);

}  // namespace foresight
