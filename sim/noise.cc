#include "sim/noise.h"

#include <algorithm>

namespace foresight::sim {
namespace {

// Where each pixel of an axis lies between the random values of an octave.
struct Axis {
  std::vector<int> low, high;
  std::vector<float> weight;  // of `high`

  Axis(int size, int cells) : low(size), high(size), weight(size) {
    for (int i = 0; i < size; ++i) {
      const float position =
          (static_cast<float>(i) + 0.5f) * static_cast<float>(cells) / static_cast<float>(size);
      const int cell = static_cast<int>(position);
      const float f = position - static_cast<float>(cell);
      low[i] = cell % cells;
      high[i] = (cell + 1) % cells;
      weight[i] = f * f * (3 - 2 * f);
    }
  }
};

void add_octave(int width, int height, int cells_x, int cells_y, float amplitude, Random& random,
                std::vector<float>& sum) {
  std::vector<float> lattice(static_cast<size_t>(cells_x) * cells_y);
  for (float& value : lattice) value = static_cast<float>(random.uniform(-1, 1)) * amplitude;
  const Axis across(width, cells_x), down(height, cells_y);
  std::vector<float> row(cells_x);
  for (int y = 0; y < height; ++y) {
    const float* upper = &lattice[static_cast<size_t>(down.low[y]) * cells_x];
    const float* lower = &lattice[static_cast<size_t>(down.high[y]) * cells_x];
    for (int x = 0; x < cells_x; ++x) row[x] = upper[x] + (lower[x] - upper[x]) * down.weight[y];
    float* out = &sum[static_cast<size_t>(y) * width];
    for (int x = 0; x < width; ++x) {
      const float left = row[across.low[x]];
      out[x] += left + (row[across.high[x]] - left) * across.weight[x];
    }
  }
}

}  // namespace

std::vector<float> fractal_noise(int width, int height, const NoiseShape& shape, Random& random) {
  std::vector<float> sum(static_cast<size_t>(width) * height);
  int cells_x = shape.cells_x, cells_y = shape.cells_y;
  float amplitude = 1, total = 0;
  for (int octave = 0; octave < shape.octaves; ++octave) {
    add_octave(width, height, std::min(cells_x, width), std::min(cells_y, height), amplitude,
               random, sum);
    total += amplitude;
    amplitude *= shape.persistence;
    cells_x *= 2;
    cells_y *= 2;
  }
  for (float& value : sum) value *= 1.5f / total;
  return sum;
}

}  // namespace foresight::sim
