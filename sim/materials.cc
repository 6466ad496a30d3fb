#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "sim/noise.h"
#include "sim/textures.h"

namespace foresight::sim {
namespace {

Rgb mix(const Rgb& a, const Rgb& b, double weight_of_b) { return a + (b - a) * weight_of_b; }

cv::Vec3b to_pixel(const Rgb& colour) {
  return {cv::saturate_cast<uint8_t>(colour[0]), cv::saturate_cast<uint8_t>(colour[1]),
          cv::saturate_cast<uint8_t>(colour[2])};
}

void for_each_pixel(cv::Mat& image, const std::function<Rgb(int, int, size_t)>& colour) {
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      image.at<cv::Vec3b>(y, x) = to_pixel(colour(x, y, static_cast<size_t>(y) * image.cols + x));
    }
  }
}

// Dark short strokes along the grain: pores, the corners that wood gives a tracker.
void add_pores(cv::Mat& image, int count, Random& random) {
  for (int i = 0; i < count; ++i) {
    const int x = random.below(image.cols), y = random.below(image.rows);
    const int length = 3 + random.below(14);
    const double depth = random.uniform(0.55, 0.85);
    for (int k = 0; k < length; ++k) {
      cv::Vec3b& pixel = image.at<cv::Vec3b>(y, (x + k) % image.cols);
      for (int c = 0; c < 3; ++c) pixel[c] = cv::saturate_cast<uint8_t>(pixel[c] * depth);
    }
  }
}

void add_knots(cv::Mat& image, int count, const Rgb& colour, Random& random) {
  for (int i = 0; i < count; ++i) {
    const cv::Point centre(40 + random.below(image.cols - 80), 20 + random.below(image.rows - 40));
    const int size = 5 + random.below(9);
    for (int ring = size; ring > 0; ring -= 2) {
      const Rgb tone = colour * (ring % 4 < 2 ? 0.62 : 0.85);
      cv::ellipse(image, centre, {ring * 2, ring}, 0, 0, 360, tone, 1 + (ring < 4 ? 2 : 0),
                  cv::LINE_AA);
    }
  }
}

}  // namespace

cv::Mat paint_wood(int width, int height, const WoodLook& look, Random& random) {
  cv::Mat image(height, width, CV_8UC3);
  const std::vector<float> bend = fractal_noise(width, height, {2, 4, 3, 0.5f}, random);
  const std::vector<float> streaks = fractal_noise(width, height, {4, 128, 3, 0.7f}, random);
  const int plank_height = height / look.planks;
  std::vector<double> tone(look.planks), rings(look.planks);
  for (double& t : tone) t = look.planks > 1 ? random.uniform(-0.25, 0.25) : 0.0;
  for (double& r : rings) r = random.uniform(5, 9);
  for_each_pixel(image, [&](int, int y, size_t i) {
    const int plank = std::min(y / plank_height, look.planks - 1);
    const double across = static_cast<double>(y) / height;
    const double wave = std::sin(2 * std::numbers::pi * (rings[plank] * across + 2.5 * bend[i]));
    double dark = 0.42 + 0.16 * wave + 0.55 * streaks[i] + tone[plank];
    if (look.planks > 1 && y % plank_height < 2) dark = 1.5;  // the gap
    return mix(look.light, look.dark, std::clamp(dark, 0.0, 1.5));
  });
  add_pores(image, width * height / 500, random);
  add_knots(image, 2 + width * height / 400000, look.dark, random);
  return image;
}

cv::Mat paint_brick(int width, int height, const BrickLook& look, Random& random) {
  cv::Mat image(height, width, CV_8UC3);
  const std::vector<float> edge = fractal_noise(width, height, {32, 32, 3, 0.6f}, random);
  const std::vector<float> face = fractal_noise(width, height, {16, 16, 6, 0.75f}, random);
  std::vector<double> tone(static_cast<size_t>(look.columns) * look.rows);
  for (double& t : tone) t = random.uniform(0.78, 1.14);
  const double brick_width = static_cast<double>(width) / look.columns;
  const double brick_height = static_cast<double>(height) / look.rows;
  const double joint = 0.055 * brick_width;
  for_each_pixel(image, [&](int x, int y, size_t i) {
    const int row = static_cast<int>(y / brick_height);
    const double shifted = x + (row % 2) * brick_width / 2;
    const int column = static_cast<int>(shifted / brick_width) % look.columns;
    const double in_x = std::fmod(shifted, brick_width), in_y = std::fmod(y, brick_height);
    const double depth =
        std::min({in_x, brick_width - in_x, in_y, brick_height - in_y}) + 2.5 * edge[i] - joint / 2;
    const double grain = 1 + 0.28 * face[i];
    if (depth < 0) return look.mortar * (0.92 + 0.25 * face[i]);
    const double bevel = depth < 3 ? (in_y < brick_height / 2 ? 1.12 : 0.78) : 1.0;
    return look.brick * (tone[static_cast<size_t>(row) * look.columns + column] * grain * bevel);
  });
  return image;
}

cv::Mat paint_plaster(int size, const Rgb& colour, double contrast, Random& random) {
  cv::Mat image(size, size, CV_8UC3, colour);
  add_wear(image, contrast, contrast, random);
  return image;
}

cv::Mat paint_flecks(int size, const Rgb& colour, double contrast, int flecks, Random& random) {
  cv::Mat image(size, size, CV_8UC3, colour);
  for (int i = 0; i < flecks; ++i) {
    const cv::Point centre(random.below(size), random.below(size));
    const cv::Size axes(1 + random.below(3), 1 + random.below(3));
    const double tone = random.uniform(0.55, 1.4);
    // Drawn at the opposite edges too, so that it tiles.
    for (const int dx : {-size, 0, size}) {
      for (const int dy : {-size, 0, size}) {
        if (std::abs(centre.x + dx - size / 2) > size / 2 + 8) continue;
        if (std::abs(centre.y + dy - size / 2) > size / 2 + 8) continue;
        cv::ellipse(image, centre + cv::Point(dx, dy), axes, 0, 0, 360, colour * tone, cv::FILLED);
      }
    }
  }
  add_wear(image, contrast, contrast / 2, random);
  return image;
}

cv::Mat paint_ceiling(int size, Random& random) {
  cv::Mat image = paint_flecks(size, {226, 225, 220}, 4, size, random);
  cv::rectangle(image, {0, 0}, {size - 1, size - 1}, {170, 170, 168}, 6);
  return image;
}

cv::Mat paint_fabric(int size, const Rgb& colour, Random& random) {
  cv::Mat image(size, size, CV_8UC3);
  const std::vector<float> worn = fractal_noise(size, size, {8, 8, 5, 0.6f}, random);
  for_each_pixel(image, [&](int x, int y, size_t i) {
    const bool over = (x / 4 + y / 4) % 2 == 0;
    const double thread = over ? 0.9 + 0.05 * (x % 4) : 0.78 + 0.05 * (y % 4);
    return colour * (thread + 0.25 * worn[i]);
  });
  return image;
}

cv::Mat paint_leaf(const Rgb& colour, Random& random) {
  cv::Mat image(64, 128, CV_8UC3, colour);
  for (int x = 4; x < 128; x += 10) {
    cv::line(image, {x, 32}, {x + 14, 4}, colour * 0.75, 1, cv::LINE_AA);
    cv::line(image, {x, 32}, {x + 14, 60}, colour * 0.75, 1, cv::LINE_AA);
  }
  cv::line(image, {0, 32}, {127, 32}, colour * 1.4, 2, cv::LINE_AA);
  add_wear(image, 18, 6, random);
  return image;
}

}  // namespace foresight::sim
