// An RGB texture with its mip levels, and bilinear sampling in fixed point. Also holds light maps.
// Coordinates (u, v) run from (0, 0) at the upper left corner of the texture to (1, 1).
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace foresight::sim {

/// Red, green, blue in 1/256 levels: 0 … 255·256.
struct FixedColour {
  uint32_t red_and_blue = 0;  // red in the low 16 bits
  uint32_t green = 0;
};

struct TextureLevel {
  int width = 0;
  int height = 0;
  std::vector<uint32_t> texels;  // 0x00BBGGRR, rows from the top
};

struct Texture {
  bool tiled = false;                // repeats beyond [0, 1], else clamps
  std::vector<TextureLevel> levels;  // each half the size of the one before; sides are powers of 2
};

/// From an RGB image (CV_8UC3, red first). The sides are resized to the next power of two.
Texture make_texture(const cv::Mat& rgb, bool tiled);

/// Packs three levels 0 … 255 (clamped) into a texel.
uint32_t pack_texel(float red, float green, float blue);

/// Weighted mean of the four texels at (x, y) in texels, texel centres at integers; the corner
/// texel is (x0, y0), the next (x1, y1).
inline FixedColour blend_texels(const TextureLevel& level, int x0, int x1, int y0, int y1,
                                uint32_t fraction_x, uint32_t fraction_y) {
  const uint32_t* upper = level.texels.data() + static_cast<size_t>(y0) * level.width;
  const uint32_t* lower = level.texels.data() + static_cast<size_t>(y1) * level.width;
  const uint32_t w11 = (fraction_x * fraction_y) >> 8;
  const uint32_t w01 = fraction_x - w11, w10 = fraction_y - w11;
  const uint32_t w00 = 256 - w01 - w10 - w11;
  constexpr uint32_t kRedBlue = 0x00FF00FF, kGreen = 0xFF;
  const uint32_t a = upper[x0], b = upper[x1], c = lower[x0], d = lower[x1];
  return {w00 * (a & kRedBlue) + w01 * (b & kRedBlue) + w10 * (c & kRedBlue) + w11 * (d & kRedBlue),
          w00 * ((a >> 8) & kGreen) + w01 * ((b >> 8) & kGreen) + w10 * ((c >> 8) & kGreen) +
              w11 * ((d >> 8) & kGreen)};
}

/// Bilinear sample of one level.
inline FixedColour sample_level(const TextureLevel& level, bool tiled, float u, float v) {
  // In 1/256 texels, where truncation instead of rounding does not matter.
  const int x = static_cast<int>(u * static_cast<float>(256 * level.width)) - 128;
  const int y = static_cast<int>(v * static_cast<float>(256 * level.height)) - 128;
  int x0 = x >> 8, y0 = y >> 8, x1 = x0 + 1, y1 = y0 + 1;
  if (tiled) {
    const int mask_x = level.width - 1, mask_y = level.height - 1;
    x0 &= mask_x, x1 &= mask_x, y0 &= mask_y, y1 &= mask_y;
  } else {
    const auto clamp = [](int i, int size) { return i < 0 ? 0 : i >= size ? size - 1 : i; };
    x0 = clamp(x0, level.width), x1 = clamp(x1, level.width);
    y0 = clamp(y0, level.height), y1 = clamp(y1, level.height);
  }
  return blend_texels(level, x0, x1, y0, y1, static_cast<uint32_t>(x & 255),
                      static_cast<uint32_t>(y & 255));
}

/// The two mip levels to mix, and how.
struct TextureFilter {
  int level = 0;
  uint32_t weight_of_next = 0;  // of 256
};
/// For pixels that cover `footprint_texels` of the first level.
TextureFilter texture_filter(const Texture& texture, float footprint_texels);

inline FixedColour mix(const FixedColour& a, const FixedColour& b, uint32_t weight_of_b) {
  const uint32_t weight_of_a = 256 - weight_of_b;
  constexpr uint32_t kLow = 0xFFFF;
  const uint32_t red =
      ((a.red_and_blue & kLow) * weight_of_a + (b.red_and_blue & kLow) * weight_of_b) >> 8;
  const uint32_t blue =
      ((a.red_and_blue >> 16) * weight_of_a + (b.red_and_blue >> 16) * weight_of_b) >> 8;
  return {red | blue << 16, (a.green * weight_of_a + b.green * weight_of_b) >> 8};
}

/// Trilinear sample.
inline FixedColour sample_texture(const Texture& texture, const TextureFilter& filter, float u,
                                  float v) {
  const FixedColour fine = sample_level(texture.levels[filter.level], texture.tiled, u, v);
  if (filter.weight_of_next == 0) return fine;
  return mix(fine, sample_level(texture.levels[filter.level + 1], texture.tiled, u, v),
             filter.weight_of_next);
}

}  // namespace foresight::sim
