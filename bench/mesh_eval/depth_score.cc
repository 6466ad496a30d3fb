#include "bench/mesh_eval/depth_score.h"

#include <algorithm>
#include <cmath>

namespace foresight {
namespace {

template <class Test>
double share(const std::vector<float>& errors, const Test& test) {
  const auto count = std::count_if(errors.begin(), errors.end(), test);
  return errors.empty() ? 0 : static_cast<double>(count) / static_cast<double>(errors.size());
}

double median_of_magnitudes(std::vector<float> errors) {
  if (errors.empty()) return 0;
  for (float& e : errors) e = std::abs(e);
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  return static_cast<double>(*middle);
}

}  // namespace

void DepthScorer::add(const SeenMesh& seen, const PixelRays& rays, const cv::Mat& depth_m,
                      double metres_per_mu) {
  ++images_;
  for (int row = 0; row < rays.rows(); ++row) {
    for (int col = 0; col < rays.cols(); ++col) {
      const float measured_m = depth_m.at<float>(row * rays.step(), col * rays.step());
      if (measured_m <= 0) continue;
      const auto surface = static_cast<Surface>(seen.surface.at<uint8_t>(row, col));
      if (surface == Surface::kNone) ++open_;
      if (surface == Surface::kGuessed) ++guessed_;
      if (surface != Surface::kMeasured) continue;
      errors_.push_back(depth_error(seen.depth_mu.at<float>(row, col), metres_per_mu, measured_m));
    }
  }
}

DepthScore DepthScorer::score() const {
  DepthScore s;
  s.images = images_;
  const auto measured = static_cast<int64_t>(errors_.size());
  s.pixels = measured + guessed_ + open_;
  const double pixels = static_cast<double>(std::max<int64_t>(1, s.pixels));
  s.measured_share = static_cast<double>(measured) / pixels;
  s.guessed_share = static_cast<double>(guessed_) / pixels;
  s.open_share = static_cast<double>(open_) / pixels;
  s.within_5_percent = share(errors_, [](float e) { return std::abs(e) <= 0.05f; });
  s.within_10_percent = share(errors_, [](float e) { return std::abs(e) <= 0.1f; });
  s.in_front_10_percent = share(errors_, [](float e) { return e < -0.1f; });
  s.behind_10_percent = share(errors_, [](float e) { return e > 0.1f; });
  s.median_error_percent = 100 * median_of_magnitudes(errors_);
  return s;
}

}  // namespace foresight
