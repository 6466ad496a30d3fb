// Tileable fractal value noise, the raw material of the procedural textures.
#pragma once

#include <vector>

#include "sim/random.h"

namespace foresight::sim {

struct NoiseShape {
  int cells_x = 4;  // random values across the first octave; powers of two tile best
  int cells_y = 4;
  int octaves = 5;           // each has twice the cells of the one before
  float persistence = 0.5f;  // amplitude of an octave relative to the one before
};

/// width × height values, row by row, about in [−1, 1] with mean near 0; repeats seamlessly.
std::vector<float> fractal_noise(int width, int height, const NoiseShape& shape, Random& random);

}  // namespace foresight::sim
