// image_t to pixels and back (JPEG by libturbojpeg). Sizes are checked against the message's and
// against kMaxPixels before anything is allocated.
#pragma once

#include <cstdint>
#include <optional>

#include "common/image.h"
#include "foresight/image_t.hpp"

namespace foresight {

constexpr int64_t kMaxPixels = 8192LL * 8192;

/// Decodes to 1 or 3 channels; nothing when the data is damaged or contradicts the message's size.
std::optional<Image> decode_image(const image_t& message, int channels);

/// Fills width, height, encoding and data. `quality` 1…100.
void encode_jpeg(const Image& image, int quality, image_t* message);
/// Uncompressed GRAY8 or RGB8.
void encode_raw(const Image& image, image_t* message);

}  // namespace foresight
