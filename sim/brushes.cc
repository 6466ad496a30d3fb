#include <algorithm>
#include <array>
#include <cctype>
#include <opencv2/imgproc.hpp>

#include "sim/noise.h"
#include "sim/textures.h"

namespace foresight::sim {
namespace {

constexpr std::array kWords = {
    "robot",    "camera",  "delay",    "motion",    "surface",  "mesh",    "joint",    "frame",
    "the",      "of",      "and",      "with",      "under",    "before",  "tracking", "map",
    "light",    "Figure",  "scale",    "operator",  "remote",   "display", "predict",  "view",
    "keyframe", "carving", "a",        "is",        "from",     "point",   "ray",      "volume",
    "texture",  "bundle",  "pose",     "estimate",  "error",    "metres",  "seconds",  "arm",
    "gripper",  "haptic",  "signal",   "network",   "between",  "model",   "unknown",  "scene",
    "online",   "vision",  "control",  "Table",     "measured", "angle",   "we",       "observe",
    "result",   "in",      "velocity", "trajectory"};

constexpr double kCapitalHeight_px = 21;  // of OpenCV's simplex font at scale 1

}  // namespace

std::string random_words(int count, Random& random) {
  std::string text;
  for (int i = 0; i < count; ++i) {
    if (i > 0) text += ' ';
    text += kWords[random.below(static_cast<int>(kWords.size()))];
  }
  return text;
}

void write_words(cv::Mat& image, const cv::Rect& area, const TextStyle& style, Random& random) {
  const double scale = style.height_px / kCapitalHeight_px;
  const int pitch = std::max(1, static_cast<int>(style.height_px * style.spacing));
  const int font = style.height_px > 12 ? cv::FONT_HERSHEY_DUPLEX : cv::FONT_HERSHEY_SIMPLEX;
  const double glyph_px = 18.5 * scale;
  bool paragraph_ends = false;
  for (int y = area.y + pitch; y <= area.y + area.height; y += pitch) {
    if (paragraph_ends) {
      paragraph_ends = false;
      y += pitch / 2;
      continue;
    }
    paragraph_ends = random.below(7) == 0;
    const double width = area.width * (paragraph_ends ? random.uniform(0.3, 0.8) : 1.0);
    std::string line = random_words(1, random);
    for (;;) {
      const std::string longer = line + " " + random_words(1, random);
      if (static_cast<double>(longer.size()) * glyph_px > width) break;
      line = longer;
    }
    cv::putText(image, line, {area.x, y}, font, scale, style.colour, 1, cv::LINE_AA);
  }
}

void write_line(cv::Mat& image, const cv::Rect& area, const std::string& text, const Rgb& colour,
                int thickness) {
  const cv::Size unit = cv::getTextSize(text, cv::FONT_HERSHEY_DUPLEX, 1, thickness, nullptr);
  const double scale = std::min(static_cast<double>(area.width) / unit.width,
                                static_cast<double>(area.height) / (unit.height + 4));
  const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_DUPLEX, scale, thickness, nullptr);
  cv::putText(image, text,
              {area.x + (area.width - size.width) / 2, area.y + (area.height + size.height) / 2},
              cv::FONT_HERSHEY_DUPLEX, scale, colour, thickness, cv::LINE_AA);
}

Rgb random_colour(Random& random) {
  static const std::array<Rgb, 10> kPalette = {
      Rgb{178, 52, 42},  Rgb{32, 84, 140}, Rgb{226, 168, 44},  Rgb{46, 122, 86},  Rgb{92, 62, 122},
      Rgb{214, 112, 48}, Rgb{58, 60, 68},  Rgb{196, 188, 170}, Rgb{40, 140, 150}, Rgb{150, 40, 84}};
  Rgb colour = kPalette[random.below(static_cast<int>(kPalette.size()))];
  for (int i = 0; i < 3; ++i) colour[i] = std::clamp(colour[i] + random.uniform(-14, 14), 0., 255.);
  return colour;
}

void add_wear(cv::Mat& image, double amplitude, double grain, Random& random) {
  const std::vector<float> stains = fractal_noise(image.cols, image.rows, {4, 4, 5, 0.6f}, random);
  for (int y = 0; y < image.rows; ++y) {
    uint8_t* row = image.ptr<uint8_t>(y);
    for (int x = 0; x < image.cols; ++x) {
      const uint64_t bits = random.next();
      const double fine = (static_cast<double>(bits & 0xFFFF) / 65536 +
                           static_cast<double>(bits >> 16 & 0xFFFF) / 65536 - 1) *
                          grain;
      const double change = stains[static_cast<size_t>(y) * image.cols + x] * amplitude + fine;
      for (int c = 0; c < 3; ++c)
        row[3 * x + c] = cv::saturate_cast<uint8_t>(row[3 * x + c] + change);
    }
  }
}

}  // namespace foresight::sim
