// How close a picture is to the truth.
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

namespace foresight {

/// Widths of the windows that ssim() and feature_displacements_px() look through.
constexpr int kSsimWindow_px = 11, kTrackingWindow_px = 21;

/// Peak signal-to-noise ratio in dB of two 8-bit RGB pictures over the pixels where `mask` is not
/// zero (empty mask: all). Nothing when the mask is empty of pixels. Capped at 60 dB.
std::optional<double> psnr_db(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask = {});

/// Mean structural similarity of the luma over the mask (Wang et al. 2004: Gaussian window
/// σ = 1.5 px, K1 = 0.01, K2 = 0.03).
std::optional<double> ssim(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask = {});

/// Distances in px between corners of `truth` and where they appear in `view`, found by pyramidal
/// Lucas–Kanade tracking there and back; corners that cannot be found again are left out.
/// `mask`: where corners of the truth count.
std::vector<double> feature_displacements_px(const cv::Mat& truth, const cv::Mat& view,
                                             const cv::Mat& mask = {});

/// p in 0…1 by nearest rank; NaN when empty.
double percentile(std::vector<double> values, double p);

}  // namespace foresight
