#include "sim/texture.h"

#include <algorithm>
#include <bit>
#include <opencv2/imgproc.hpp>

#include "common/check.h"

namespace foresight::sim {
namespace {

TextureLevel level_from_image(const cv::Mat& rgb) {
  TextureLevel level{rgb.cols, rgb.rows, {}};
  level.texels.reserve(rgb.total());
  for (int y = 0; y < rgb.rows; ++y) {
    const uint8_t* row = rgb.ptr<uint8_t>(y);
    for (int x = 0; x < rgb.cols; ++x) {
      level.texels.push_back(row[3 * x] | uint32_t{row[3 * x + 1]} << 8 |
                             uint32_t{row[3 * x + 2]} << 16);
    }
  }
  return level;
}

TextureLevel halved(const TextureLevel& in) {
  TextureLevel out{std::max(in.width / 2, 1), std::max(in.height / 2, 1), {}};
  out.texels.reserve(static_cast<size_t>(out.width) * out.height);
  const int step_x = in.width > 1 ? 1 : 0, step_y = in.height > 1 ? in.width : 0;
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      const uint32_t* p = &in.texels[static_cast<size_t>(2 * y) * in.width * (step_y ? 1 : 0) +
                                     static_cast<size_t>(2 * x) * step_x];
      const uint32_t texels[4] = {p[0], p[step_x], p[step_y], p[step_x + step_y]};
      uint32_t red_and_blue = 0x00020002, green = 2;
      for (const uint32_t t : texels) {
        red_and_blue += t & 0x00FF00FF;
        green += (t >> 8) & 0xFF;
      }
      out.texels.push_back(((red_and_blue >> 2) & 0x00FF00FF) | ((green >> 2) & 0xFF) << 8);
    }
  }
  return out;
}

}  // namespace

Texture make_texture(const cv::Mat& rgb, bool tiled) {
  FORESIGHT_CHECK(rgb.type() == CV_8UC3 && rgb.cols > 0 && rgb.rows > 0);
  const cv::Size size(static_cast<int>(std::bit_ceil(static_cast<unsigned>(rgb.cols))),
                      static_cast<int>(std::bit_ceil(static_cast<unsigned>(rgb.rows))));
  cv::Mat resized = rgb;
  if (size != rgb.size()) cv::resize(rgb, resized, size, 0, 0, cv::INTER_LINEAR);
  Texture texture{tiled, {level_from_image(resized)}};
  while (texture.levels.back().width > 1 || texture.levels.back().height > 1) {
    texture.levels.push_back(halved(texture.levels.back()));
  }
  return texture;
}

uint32_t pack_texel(float red, float green, float blue) {
  const auto byte = [](float x) {
    return static_cast<uint32_t>(std::clamp(x, 0.0f, 255.0f) + 0.5f);
  };
  return byte(red) | byte(green) << 8 | byte(blue) << 16;
}

TextureFilter texture_filter(const Texture& texture, float footprint_texels) {
  if (!(footprint_texels > 1)) return {};
  // log2 in 1/256: the exponent, and the mantissa as its linear approximation (error < 0.09).
  const auto log2 = (std::bit_cast<uint32_t>(footprint_texels) >> 15) - (127u << 8);
  const int last = static_cast<int>(texture.levels.size()) - 1;
  const int level = static_cast<int>(log2 >> 8);
  if (level >= last) return {last, 0};
  // Blends in the middle half between two levels only: less work, and the steps stay invisible.
  const int weight = 2 * (static_cast<int>(log2 & 255) - 64);
  if (weight >= 256) return {level + 1, 0};
  return {level, weight <= 0 ? 0 : static_cast<uint32_t>(weight)};
}

}  // namespace foresight::sim
