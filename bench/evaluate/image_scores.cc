#include "bench/evaluate/image_scores.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace foresight {
namespace {

constexpr double kMaxPsnr_db = 60;

cv::Mat luma(const cv::Mat& rgb, int type) {
  cv::Mat gray;
  cv::cvtColor(rgb, gray, cv::COLOR_RGB2GRAY);
  gray.convertTo(gray, type);
  return gray;
}

cv::Mat blur(const cv::Mat& m) {
  cv::Mat out;
  cv::GaussianBlur(m, out, {kSsimWindow_px, kSsimWindow_px}, 1.5);
  return out;
}

}  // namespace

std::optional<double> psnr_db(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask) {
  const double count = mask.empty() ? static_cast<double>(a.total()) : cv::countNonZero(mask);
  if (count == 0) return std::nullopt;
  const double norm =
      mask.empty() ? cv::norm(a, b, cv::NORM_L2SQR) : cv::norm(a, b, cv::NORM_L2SQR, mask);
  const double mse = norm / (count * a.channels());
  return mse < 1e-9 ? kMaxPsnr_db : std::min(kMaxPsnr_db, 10 * std::log10(255.0 * 255.0 / mse));
}

std::optional<double> ssim(const cv::Mat& a, const cv::Mat& b, const cv::Mat& mask) {
  if (!mask.empty() && cv::countNonZero(mask) == 0) return std::nullopt;
  constexpr double kC1 = 0.01 * 255 * 0.01 * 255, kC2 = 0.03 * 255 * 0.03 * 255;
  const cv::Mat x = luma(a, CV_32F), y = luma(b, CV_32F);
  const cv::Mat mean_x = blur(x), mean_y = blur(y);
  const cv::Mat var_x = blur(x.mul(x)) - mean_x.mul(mean_x);
  const cv::Mat var_y = blur(y.mul(y)) - mean_y.mul(mean_y);
  const cv::Mat cov = blur(x.mul(y)) - mean_x.mul(mean_y);
  const cv::Mat numerator = (2 * mean_x.mul(mean_y) + kC1).mul(2 * cov + kC2);
  const cv::Mat denominator =
      (mean_x.mul(mean_x) + mean_y.mul(mean_y) + kC1).mul(var_x + var_y + kC2);
  cv::Mat map;
  cv::divide(numerator, denominator, map);
  return cv::mean(map, mask.empty() ? cv::noArray() : mask)[0];
}

std::vector<double> feature_displacements_px(const cv::Mat& truth, const cv::Mat& view,
                                             const cv::Mat& mask) {
  const cv::Mat from = luma(truth, CV_8U), to = luma(view, CV_8U);
  std::vector<cv::Point2f> corners, found, back;
  cv::goodFeaturesToTrack(from, corners, 300, 0.01, 10, mask);
  if (corners.empty()) return {};
  std::vector<uchar> ok_there, ok_back;
  std::vector<float> error;
  const cv::Size window(kTrackingWindow_px, kTrackingWindow_px);
  cv::calcOpticalFlowPyrLK(from, to, corners, found, ok_there, error, window, 4);
  cv::calcOpticalFlowPyrLK(to, from, found, back, ok_back, error, window, 4);
  std::vector<double> distances;
  for (size_t i = 0; i < corners.size(); ++i) {
    if (ok_there[i] == 0 || ok_back[i] == 0) continue;
    if (cv::norm(back[i] - corners[i]) > 1.0) continue;
    distances.push_back(cv::norm(found[i] - corners[i]));
  }
  return distances;
}

double percentile(std::vector<double> values, double p) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto rank =
      static_cast<size_t>(std::clamp(std::ceil(p * static_cast<double>(values.size())) - 1, 0.0,
                                     static_cast<double>(values.size() - 1)));
  std::nth_element(values.begin(), values.begin() + static_cast<int64_t>(rank), values.end());
  return values[rank];
}

}  // namespace foresight
