#include "procs/slam/corner_detector.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <tuple>

#include "procs/slam/geometry.h"

namespace foresight::slam {
namespace {

using Eigen::Vector2d;

constexpr std::array<double, kLevels> kLevelShare = {0.58, 0.26, 0.16, 0.0};
constexpr int kBorder = 8;            // px of the level: room for the patch
constexpr double kMinSpacing = 9;     // px of the full image
constexpr int kCell = 64;             // px of the full image
constexpr double kMaxRefinement = 3;  // px of the level
constexpr double kMinScore = 25;      // gray levels², mean over the patch

// Smaller eigenvalue of the mean structure tensor over 8×8 pixels.
double shi_tomasi(const cv::Mat& image, int x, int y) {
  int xx = 0, xy = 0, yy = 0;
  for (int v = y - 4; v < y + 4; ++v) {
    const uint8_t* row = image.ptr<uint8_t>(v);
    const uint8_t* above = image.ptr<uint8_t>(v - 1);
    const uint8_t* below = image.ptr<uint8_t>(v + 1);
    for (int u = x - 4; u < x + 4; ++u) {
      const int gx = row[u + 1] - row[u - 1], gy = below[u] - above[u];
      xx += gx * gx;
      xy += gx * gy;
      yy += gy * gy;
    }
  }
  const double a = xx / 256.0, b = xy / 256.0, c = yy / 256.0;
  return 0.5 * (a + c - std::sqrt((a - c) * (a - c) + 4 * b * b));
}

struct Scored {
  cv::Point place;
  double score;
};

std::vector<Scored> candidates(const cv::Mat& image) {
  std::vector<cv::KeyPoint> found;
  cv::FAST(image, found, 10, true);
  std::vector<Scored> scored;
  for (const cv::KeyPoint& k : found) {
    const int x = cvRound(k.pt.x), y = cvRound(k.pt.y);
    if (x < kBorder || y < kBorder || x >= image.cols - kBorder || y >= image.rows - kBorder) {
      continue;
    }
    const double score = shi_tomasi(image, x, y);
    if (score > kMinScore) scored.push_back({{x, y}, score});
  }
  std::sort(scored.begin(), scored.end(), [](const Scored& a, const Scored& b) {
    return std::tuple(-a.score, a.place.y, a.place.x) < std::tuple(-b.score, b.place.y, b.place.x);
  });
  return scored;
}

// Where the corner itself is: the lines through nearby edges meet there. A point must sit on what
// its patch shows; beside an object's outline it would float in front of the background.
Vector2d refined(const cv::Mat& image, const Scored& corner) {
  std::vector<cv::Point2f> place = {cv::Point2f(corner.place)};
  cv::cornerSubPix(image, place, cv::Size(3, 3), cv::Size(-1, -1),
                   {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 5, 0.05});
  const Vector2d found(place[0].x, place[0].y), detected(corner.place.x, corner.place.y);
  return (found - detected).norm() < kMaxRefinement ? found : detected;
}

}  // namespace

OccupancyMask::OccupancyMask(int width_px, int height_px)
    : mask_(cv::Mat::zeros(height_px, width_px, CV_8UC1)) {}

void OccupancyMask::add(const Vector2d& pixel, double radius_px) {
  cv::circle(mask_, cv::Point(cvRound(pixel.x()), cvRound(pixel.y())), cvRound(radius_px), 255, -1);
}

bool OccupancyMask::contains(const Vector2d& pixel) const {
  const int x = cvRound(pixel.x()), y = cvRound(pixel.y());
  return x < 0 || y < 0 || x >= mask_.cols || y >= mask_.rows || mask_.at<uint8_t>(y, x) != 0;
}

std::vector<DetectedCorner> detect_corners(const ImagePyramid& pyramid, int count,
                                           OccupancyMask* occupied) {
  const cv::Mat& image = pyramid.levels[0];
  const double cells =
      std::max(1.0, static_cast<double>(image.cols) * image.rows / (kCell * kCell));
  std::vector<DetectedCorner> corners;
  for (int level = kLevels - 1; level >= 0; --level) {
    const double share = kLevelShare[static_cast<size_t>(level)] * count;
    if (share < 1) continue;
    const int per_cell = std::max(1, static_cast<int>(std::ceil(2 * share / cells)));
    std::map<std::pair<int, int>, int> taken;
    int left = static_cast<int>(share);
    for (const Scored& s : candidates(pyramid.levels[static_cast<size_t>(level)])) {
      if (left == 0) break;
      Vector2d pixel = image_from_level(Vector2d(s.place.x, s.place.y), level);
      if (occupied->contains(pixel)) continue;
      int& in_cell =
          taken[{static_cast<int>(pixel.y()) / kCell, static_cast<int>(pixel.x()) / kCell}];
      if (in_cell >= per_cell) continue;
      ++in_cell;
      --left;
      occupied->add(pixel, kMinSpacing);
      pixel = image_from_level(refined(pyramid.levels[static_cast<size_t>(level)], s), level);
      corners.push_back({pixel, level});
    }
  }
  return corners;
}

std::optional<Corner> make_corner(const CameraModel& camera, KeyframeId keyframe_id,
                                  const DetectedCorner& detected) {
  const double step = level_scale(detected.level);
  Corner corner;
  corner.keyframe_id = keyframe_id;
  corner.level = detected.level;
  corner.pixel = detected.pixel;
  corner.ray = ray_from_xy(camera.unproject(detected.pixel));
  corner.ray_right = ray_from_xy(camera.unproject(detected.pixel + Vector2d(step, 0)));
  corner.ray_down = ray_from_xy(camera.unproject(detected.pixel + Vector2d(0, step)));
  corner.px_per_xy = camera.px_per_xy(corner.ray.head<2>());
  const double check = (camera.project(corner.ray) - detected.pixel).norm();
  if (!(check < 0.1)) return std::nullopt;
  return corner;
}

}  // namespace foresight::slam
