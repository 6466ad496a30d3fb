// Image pyramid of a frame: level 0 is the image, each further level halves it by 2×2 means.
// Coordinates keep pixel centres consistent: x_l = (x_0 + 0.5) / 2^l − 0.5.
#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>

#include "procs/slam/gray_image_view.h"

namespace foresight::slam {

constexpr int kLevels = 4;

struct ImagePyramid {
  std::array<cv::Mat, kLevels> levels;  // 8 bit; shared by copies, never written again
};

/// Copies the pixels.
ImagePyramid build_pyramid(const GrayImageView& image);

inline double level_scale(int level) { return static_cast<double>(1 << level); }

inline Eigen::Vector2d level_from_image(const Eigen::Vector2d& pixel, int level) {
  return (pixel.array() + 0.5) / level_scale(level) - 0.5;
}

inline Eigen::Vector2d image_from_level(const Eigen::Vector2d& pixel, int level) {
  return (pixel.array() + 0.5) * level_scale(level) - 0.5;
}

}  // namespace foresight::slam
