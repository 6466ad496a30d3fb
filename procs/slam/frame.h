// An image with what tracking and mapping need of it.
#pragma once

#include "common/time.h"
#include "procs/slam/image_pyramid.h"
#include "procs/slam/thumbnail.h"

namespace foresight::slam {

struct Frame {
  Time time;
  ImagePyramid pyramid;
  Thumbnail thumbnail;
};

}  // namespace foresight::slam
