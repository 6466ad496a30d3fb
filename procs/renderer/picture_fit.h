// A picture in a frame of another size.
#pragma once

#include "common/image.h"

namespace foresight {

/// Scales an RGB picture as large as it fits, in the middle, on black. The same picture when it has
/// that size already.
Image fit_picture(const Image& rgb, int width_px, int height_px);

}  // namespace foresight
