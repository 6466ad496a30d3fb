// 8×8 patches: affine warp from a source image, search by zero-mean normalised correlation
// (ZNCC) and sub-pixel alignment. The unit of all coordinates is the pixel of one pyramid level; a
// patch's centre lies between its four middle pixels.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>

namespace foresight::slam {

constexpr int kPatchSize = 8;
constexpr int kPatchArea = kPatchSize * kPatchSize;

struct Patch {
  static constexpr int kBordered = kPatchSize + 2;  // one pixel more on each side, for gradients
  std::array<float, kBordered * kBordered> bordered;
  std::array<int16_t, kPatchArea> pixels;
  int sum = 0;
  double energy = 0;  // Σ (pixel − mean)²
};

/// Samples the patch around `center` of `source`; `source_from_patch` maps patch offsets to offsets
/// in `source`. False if it leaves the image or has too little contrast to be found again.
bool warp_patch(const cv::Mat& source, const Eigen::Vector2d& center,
                const Eigen::Matrix2d& source_from_patch, Patch* patch);

struct PatchMatch {
  Eigen::Vector2d center;
  double zncc = -1;         // of the best position, −1…1
  double second_zncc = -1;  // best of those more than 2.5 px away (only if asked for)
};

enum class Ambiguity { kIgnore, kMeasure };

/// Best whole-pixel position whose centre lies within `margin_px` of the segment from `a` to `b`.
PatchMatch search_patch(const cv::Mat& image, const Patch& patch, const Eigen::Vector2d& a,
                        const Eigen::Vector2d& b, double margin_px,
                        Ambiguity ambiguity = Ambiguity::kIgnore);

/// Inverse-compositional alignment over shift and brightness from `start`. Empty if it does not
/// converge, leaves the image or moves more than 2 px. `match.zncc` is that of the end position.
std::optional<PatchMatch> align_patch(const cv::Mat& image, const Patch& patch,
                                      const Eigen::Vector2d& start);

}  // namespace foresight::slam
