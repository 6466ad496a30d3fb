// JPEG by libjpeg, which says what exactly it warns about: the reader must tell harmless oddities
// of cameras from pictures of which a part is lost.
#pragma once

#include <cstdint>
#include <span>

#include "procs/camera/picture.h"

namespace foresight {

/// As decode_picture(), of bytes that begin as a JPEG does. `channels`: 1 or 3.
Picture decode_jpeg_picture(std::span<const uint8_t> bytes, int channels);

}  // namespace foresight
