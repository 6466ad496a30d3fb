#include "procs/slam/still_camera.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "procs/slam/geometry.h"

namespace foresight::slam {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kCell = 8;            // px of the level looked at
constexpr int kMaxWidth_px = 220;   // of that level, if there is one: some 300 cells, little noise
constexpr double kFarthest_px = 4;  // there; a longer claimed shift tells no more
constexpr double kMinContrast = 5;  // standard deviation of a cell with texture, gray levels
constexpr double kAlike = 0.85;     // correlation after the claimed shift that tells nothing
constexpr double kUnexplained = 0.15;    // of the variance that the claim would leave unexplained
constexpr int kHalfPlanes = 12;          // looked at around a cell
constexpr double kShareOnASide = 0.1;    // of the cells that are the same, on each side
constexpr double kEnclosedShare = 0.25;  // of the changed cells. Fingers and tools: up to 0.16
constexpr int kMinSame = 12;             // cells
constexpr double kMinSameShare = 0.1;    // of the cells that tell. A moving camera: 0.07 by chance
constexpr int kBlack = 8;                // gray levels above the picture's darkest
constexpr int kRimEdge_px = 2;
constexpr uint8_t kRim = 128;  // marks it

using Cell = std::array<float, kCell * kCell>;

// Bilinear. Empty outside the image.
std::optional<Cell> sample(const cv::Mat& image, double left, double top) {
  if (left < 0 || top < 0 || left + kCell > image.cols || top + kCell > image.rows) {
    return std::nullopt;
  }
  const int x0 = static_cast<int>(left), y0 = static_cast<int>(top);
  const auto u = static_cast<float>(left - x0), v = static_cast<float>(top - y0);
  Cell cell;
  for (int y = 0; y < kCell; ++y) {
    const uint8_t* upper = image.ptr(y0 + y);
    const uint8_t* lower = image.ptr(std::min(y0 + y + 1, image.rows - 1));
    for (int x = 0; x < kCell; ++x) {
      const int x1 = x0 + x, x2 = std::min(x1 + 1, image.cols - 1);
      const float above = (1 - u) * upper[x1] + u * upper[x2];
      const float below = (1 - u) * lower[x1] + u * lower[x2];
      cell[static_cast<size_t>(kCell * y + x)] = (1 - v) * above + v * below;
    }
  }
  return cell;
}

// Without its mean. Σ of squares to `energy`.
Cell centered(Cell cell, double* energy) {
  double sum = 0;
  for (const float p : cell) sum += p;
  const auto mean = static_cast<float>(sum / static_cast<double>(cell.size()));
  *energy = 0;
  for (float& p : cell) {
    p -= mean;
    *energy += static_cast<double>(p) * p;
  }
  return cell;
}

double contrast(const Cell& cell) {
  double energy;
  centered(cell, &energy);
  return std::sqrt(energy / static_cast<double>(cell.size()));
}

// Zero-mean normalised: brightness and its gain do not matter.
double correlation(const Cell& a, const Cell& b) {
  double energy_a, energy_b, sum = 0;
  const Cell p = centered(a, &energy_a), q = centered(b, &energy_b);
  if (energy_a * energy_b <= 0) return 0;
  for (size_t i = 0; i < p.size(); ++i) sum += static_cast<double>(p[i]) * q[i];
  return sum / std::sqrt(energy_a * energy_b);
}

// The gray level that a hundredth of the pixels do not reach.
int darkest(const cv::Mat& image) {
  std::array<size_t, 256> counts{};
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) ++counts[image.at<uint8_t>(y, x)];
  }
  size_t below = 0;
  int level = 0;
  while (level < 255 && 100 * (below += counts[static_cast<size_t>(level)]) <= image.total()) {
    ++level;
  }
  return level;
}

// Where the picture is black in all its corners: the rim that an endoscope or a lens hood puts
// round it goes with the camera, and so does the rim's edge.
cv::Mat black_rim(const cv::Mat& image) {
  cv::Mat rim = image < darkest(image) + kBlack;
  const int right = image.cols - 1, bottom = image.rows - 1;
  for (const cv::Point corner : {cv::Point(0, 0), {right, 0}, {0, bottom}, {right, bottom}}) {
    if (rim.at<uint8_t>(corner) == 0) return cv::Mat(image.size(), CV_8U, cv::Scalar::all(0));
    cv::floodFill(rim, corner, kRim);
  }
  rim = rim == kRim;
  cv::dilate(rim, rim, cv::Mat(), {-1, -1}, kRimEdge_px);
  return rim;
}

class CellJudge {
 public:
  CellJudge(const CameraModel& camera, const ClaimedMotion& claim)
      : camera_(camera), claim_(claim) {
    while (level_ + 1 < kLevels && (camera.width_px >> level_) > kMaxWidth_px) ++level_;
    rim_ = black_rim(first());
  }

  int columns() const { return first().cols / kCell; }
  int rows() const { return first().rows / kCell; }

  CellFate fate(int column, int row) const {
    const int left = kCell * column, top = kCell * row;
    const std::optional<Cell> before = sample(first(), left, top);
    const std::optional<Cell> after = sample(second(), left, top);
    if (!before || !after || contrast(*before) < kMinContrast) return CellFate::kUntold;
    if (cv::countNonZero(rim_(cv::Rect(left, top, kCell, kCell))) > 0) return CellFate::kUntold;
    const std::optional<Cell> claimed = as_claimed(left, top);
    if (!claimed) return CellFate::kUntold;
    const double alike = correlation(*before, *claimed);
    if (alike > kAlike) return CellFate::kUntold;
    return 1 - correlation(*before, *after) < kUnexplained * (1 - alike) ? CellFate::kSame
                                                                         : CellFate::kChanged;
  }

 private:
  const cv::Mat& first() const { return claim_.first.levels[static_cast<size_t>(level_)]; }
  const cv::Mat& second() const { return claim_.second.levels[static_cast<size_t>(level_)]; }

  // What the cell would show now if all around it were at the median depth and the claim right.
  std::optional<Cell> as_claimed(int left, int top) const {
    const Vector2d middle(left + 0.5 * (kCell - 1), top + 0.5 * (kCell - 1));
    const Vector2d xy = camera_.unproject(image_from_level(middle, level_));
    const Vector3d there = claim_.second_from_first * (claim_.depth * ray_from_xy(xy));
    if (there.z() <= 1e-3 * claim_.depth) return std::nullopt;
    Vector2d shift = level_from_image(camera_.project(there), level_) - middle;
    if (shift.norm() > kFarthest_px) shift *= kFarthest_px / shift.norm();
    const std::optional<Cell> come = sample(first(), left - shift.x(), top - shift.y());
    // At the border what comes into view is not known: what leaves changes the cell as much.
    return come ? come : sample(first(), left + shift.x(), top + shift.y());
  }

  const CameraModel& camera_;
  const ClaimedMotion& claim_;
  int level_ = 0;
  cv::Mat rim_;
};

// Tukey's depth: how many of the cells lie at least on one side of any line through `at`.
int depth_among(const std::vector<Vector2d>& cells, const Vector2d& at) {
  auto fewest = static_cast<std::ptrdiff_t>(cells.size());
  for (int i = 0; i < kHalfPlanes; ++i) {
    const double angle = 2 * M_PI * i / kHalfPlanes;
    const Vector2d normal(std::cos(angle), std::sin(angle));
    fewest = std::min(fewest, std::count_if(cells.begin(), cells.end(), [&](const Vector2d& c) {
                        return normal.dot(c - at) > 0;
                      }));
  }
  return static_cast<int>(fewest);
}

}  // namespace

bool StillEvidence::says_still() const {
  if (same < kMinSame || same < kMinSameShare * (same + changed)) return false;
  return same > changed || enclosed > kEnclosedShare * changed;
}

bool StillEvidence::confirms(const StillEvidence& earlier) const {
  int confirmed = 0, refuted = 0;
  for (size_t i = 0; i < std::min(cells.size(), earlier.cells.size()); ++i) {
    if (earlier.cells[i] != CellFate::kSame) continue;
    confirmed += cells[i] == CellFate::kSame ? 1 : 0;
    refuted += cells[i] == CellFate::kChanged ? 1 : 0;
  }
  return confirmed > refuted;
}

StillEvidence still_evidence(const CameraModel& camera, const ClaimedMotion& claim) {
  const CellJudge judge(camera, claim);
  StillEvidence evidence;
  std::vector<Vector2d> same, changed;
  for (int row = 0; row < judge.rows(); ++row) {
    for (int column = 0; column < judge.columns(); ++column) {
      const CellFate fate = judge.fate(column, row);
      evidence.cells.push_back(fate);
      if (fate == CellFate::kSame) same.emplace_back(column, row);
      if (fate == CellFate::kChanged) changed.emplace_back(column, row);
    }
  }
  evidence.same = static_cast<int>(same.size());
  evidence.changed = static_cast<int>(changed.size());
  for (const Vector2d& at : changed) {
    evidence.enclosed += depth_among(same, at) > kShareOnASide * evidence.same ? 1 : 0;
  }
  return evidence;
}

}  // namespace foresight::slam
