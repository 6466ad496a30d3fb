#include "bench/slam_eval/plot.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "common/output_file.h"

namespace foresight {
namespace {

constexpr int kPanel_px = 420, kMargin_px = 30;

void draw_path(const std::vector<Eigen::Vector3d>& path, const Eigen::Vector3d& low, double extent,
               int a, int b, const cv::Scalar& color, cv::Mat panel) {
  cv::Point last;
  for (size_t i = 0; i < path.size(); ++i) {
    const double scale = (kPanel_px - 2 * kMargin_px) / extent;
    const cv::Point p(kMargin_px + static_cast<int>(scale * (path[i][a] - low[a])),
                      kPanel_px - kMargin_px - static_cast<int>(scale * (path[i][b] - low[b])));
    if (i > 0) cv::line(panel, last, p, color, 1, cv::LINE_AA);
    last = p;
  }
}

}  // namespace

void plot_trajectory(const Evaluation& e, const std::string& file) {
  cv::Mat canvas(kPanel_px, 3 * kPanel_px, CV_8UC3, cv::Scalar::all(255));
  if (!e.truth_path.empty()) {
    Eigen::Vector3d low = e.truth_path.front(), high = low;
    for (const Eigen::Vector3d& p : e.truth_path) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    const double extent = std::max(1e-6, (high - low).maxCoeff());
    static constexpr int kPlanes[3][2] = {{0, 1}, {0, 2}, {1, 2}};
    static constexpr const char* kNames[3] = {"xy", "xz", "yz"};
    for (int i = 0; i < 3; ++i) {
      cv::Mat panel = canvas(cv::Rect(i * kPanel_px, 0, kPanel_px, kPanel_px));
      const auto [a, b] = std::pair(kPlanes[i][0], kPlanes[i][1]);
      draw_path(e.truth_path, low, extent, a, b, {150, 150, 150}, panel);
      draw_path(e.estimated_path, low, extent, a, b, {0, 120, 255}, panel);
      cv::putText(panel, e.sequence + " " + kNames[i], {10, 18}, cv::FONT_HERSHEY_SIMPLEX, 0.45,
                  cv::Scalar::all(0), 1, cv::LINE_AA);
    }
  }
  std::vector<uint8_t> bytes;
  cv::imencode(".png", canvas, bytes);
  write_output(file, bytes);
}

}  // namespace foresight
