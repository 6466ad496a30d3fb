#include "procs/camera/lens_calibration.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "common/errors.h"

namespace foresight {
namespace {

constexpr size_t kMinCorners = 12, kMinViews = 8;
constexpr int kCellColumns = 8, kCellRows = 6;
constexpr double kNewView = 0.04;    // mean shift of the corners, in image widths
constexpr double kOutlierRatio = 3;  // a view's error / the median view's
constexpr double kOutlierFloor_px = 0.5;
constexpr size_t kHoldOutEvery = 4;

std::optional<BoardView> find_chessboard(const cv::Mat& gray, const CalibrationBoard& board) {
  BoardView view;
  const cv::Size size(board.columns, board.rows);
  if (!cv::findChessboardCorners(
          gray, size, view.pixels,
          cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK)) {
    return std::nullopt;
  }
  // The window must not reach the next corner.
  double nearest_px = std::numeric_limits<double>::infinity();
  for (size_t i = 1; i < view.pixels.size(); ++i) {
    nearest_px = std::min(nearest_px, cv::norm(view.pixels[i] - view.pixels[i - 1]));
  }
  const int half = std::clamp(static_cast<int>(0.4 * nearest_px), 2, 11);
  cv::cornerSubPix(gray, view.pixels, {half, half}, {-1, -1},
                   {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 0.005});
  for (int row = 0; row < board.rows; ++row) {
    for (int column = 0; column < board.columns; ++column) {
      view.points_m.emplace_back(static_cast<float>(column * board.spacing_m),
                                 static_cast<float>(row * board.spacing_m), 0.f);
    }
  }
  return view;
}

std::optional<BoardView> find_tags(const cv::Mat& gray, const CalibrationBoard& board) {
  const auto family = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11);
  const auto parameters = cv::aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(gray, family, corners, ids, parameters);
  BoardView view;
  const double pitch = board.spacing_m + board.gap_m;
  for (size_t i = 0; i < ids.size(); ++i) {
    if (ids[i] < 0 || ids[i] >= board.columns * board.rows) continue;
    const double x = pitch * (ids[i] % board.columns), y = pitch * (ids[i] / board.columns);
    const double s = board.spacing_m;
    for (const auto& [dx, dy] : {std::pair(0., 0.), {s, 0.}, {s, s}, {0., s}}) {
      view.points_m.emplace_back(static_cast<float>(x + dx), static_cast<float>(y + dy), 0.f);
    }
    view.pixels.insert(view.pixels.end(), corners[i].begin(), corners[i].end());
  }
  if (view.pixels.size() < kMinCorners) return std::nullopt;
  return view;
}

cv::Rect2f bounds_m(const BoardView& view) {
  cv::Point2f low(view.points_m[0].x, view.points_m[0].y), high = low;
  for (const cv::Point3f& p : view.points_m) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  return {low, high};
}

// Where three fixed points of the board lie in the image, whichever corners were found. Empty if
// the view does not say.
std::vector<cv::Point2f> placement(const BoardView& view, const std::vector<cv::Point2f>& fixed_m) {
  std::vector<cv::Point2f> flat, placed;
  for (const cv::Point3f& p : view.points_m) flat.emplace_back(p.x, p.y);
  const cv::Mat homography = cv::findHomography(flat, view.pixels);
  if (!homography.empty()) cv::perspectiveTransform(fixed_m, placed, homography);
  return placed;
}

double distance_px(const BoardView& a, const BoardView& b) {
  const cv::Rect2f board = bounds_m(a);
  const std::vector<cv::Point2f> fixed = {board.tl(), board.br(), {board.x + board.width, board.y}};
  const std::vector<cv::Point2f> pa = placement(a, fixed), pb = placement(b, fixed);
  if (pa.empty() || pb.empty()) return 0;
  double sum = 0;
  for (size_t i = 0; i < fixed.size(); ++i) sum += cv::norm(pa[i] - pb[i]);
  return sum / static_cast<double>(fixed.size());
}

struct Fit {
  cv::Mat matrix, distortion;
  double focal_sigma = 0;
};

int radtan_flags() { return 0; }
int fisheye_flags() { return cv::fisheye::CALIB_RECOMPUTE_EXTRINSIC | cv::fisheye::CALIB_FIX_SKEW; }

Fit fit(const std::vector<BoardView>& views, const cv::Size& size, LensModel lens) {
  std::vector<std::vector<cv::Point3f>> points;
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const BoardView& v : views) {
    points.push_back(v.points_m);
    pixels.push_back(v.pixels);
  }
  Fit result;
  std::vector<cv::Mat> turns, shifts;
  try {
    if (lens == LensModel::kEquidistant) {
      cv::fisheye::calibrate(points, pixels, size, result.matrix, result.distortion, turns, shifts,
                             fisheye_flags());
    } else {
      cv::Mat intrinsic_sigma, extrinsic_sigma, errors;
      cv::calibrateCamera(points, pixels, size, result.matrix, result.distortion, turns, shifts,
                          intrinsic_sigma, extrinsic_sigma, errors, radtan_flags());
      result.focal_sigma = intrinsic_sigma.at<double>(0) / result.matrix.at<double>(0, 0);
    }
  } catch (const cv::Exception& e) {
    throw UnavailableError(
        "the views do not determine a lens: film the board tilted, near and far (" +
        std::string(e.err) + ")");
  }
  return result;
}

// The view's root mean square error with its best pose.
double view_error_px(const BoardView& view, const Fit& fit, LensModel lens) {
  std::vector<cv::Point2f> rays, projected;
  cv::Mat turn, shift;
  const bool fisheye = lens == LensModel::kEquidistant;
  if (fisheye) {
    cv::fisheye::undistortPoints(view.pixels, rays, fit.matrix, fit.distortion);
  } else {
    cv::undistortPoints(view.pixels, rays, fit.matrix, fit.distortion);
  }
  bool solved = false;
  try {
    solved =
        cv::solvePnP(view.points_m, rays, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), turn, shift);
  } catch (const cv::Exception&) {  // degenerate corners
  }
  if (!solved) return std::numeric_limits<double>::infinity();
  if (fisheye) {
    cv::fisheye::projectPoints(view.points_m, projected, turn, shift, fit.matrix, fit.distortion);
  } else {
    cv::projectPoints(view.points_m, turn, shift, fit.matrix, fit.distortion, projected);
  }
  double squared = 0;
  for (size_t i = 0; i < projected.size(); ++i) {
    const cv::Point2f e = projected[i] - view.pixels[i];
    squared += e.dot(e);
  }
  return std::sqrt(squared / static_cast<double>(projected.size()));
}

double rms(const std::vector<double>& errors) {
  double squared = 0;
  for (const double e : errors) squared += e * e;
  return errors.empty() ? 0 : std::sqrt(squared / static_cast<double>(errors.size()));
}

std::vector<double> errors_of(const std::vector<BoardView>& views, const Fit& fit, LensModel lens) {
  std::vector<double> errors;
  for (const BoardView& v : views) errors.push_back(view_error_px(v, fit, lens));
  return errors;
}

CameraModel camera_of(const Fit& fit, const cv::Size& size, LensModel lens) {
  CameraModel camera;
  camera.lens = lens;
  camera.width_px = size.width;
  camera.height_px = size.height;
  camera.fx_px = fit.matrix.at<double>(0, 0);
  camera.fy_px = fit.matrix.at<double>(1, 1);
  camera.cx_px = fit.matrix.at<double>(0, 2);
  camera.cy_px = fit.matrix.at<double>(1, 2);
  const size_t count = lens == LensModel::kEquidistant ? 4 : 5;
  for (size_t i = 0; i < count; ++i) {
    camera.distortion[i] = fit.distortion.at<double>(static_cast<int>(i));
  }
  camera.prepare();
  return camera;
}

}  // namespace

std::optional<BoardView> find_board(const cv::Mat& gray, const CalibrationBoard& board) {
  return board.kind == CalibrationBoard::Kind::kChessboard ? find_chessboard(gray, board)
                                                           : find_tags(gray, board);
}

bool ViewCollector::add(BoardView view) {
  for (const BoardView& other : views_) {
    if (distance_px(view, other) < kNewView * width_px_) return false;
  }
  views_.push_back(std::move(view));
  return true;
}

std::vector<std::vector<int>> ViewCollector::corners_per_cell() const {
  std::vector<std::vector<int>> counts(kCellRows, std::vector<int>(kCellColumns, 0));
  for (const BoardView& v : views_) {
    for (const cv::Point2f& p : v.pixels) {
      const int column =
          std::clamp(static_cast<int>(p.x * kCellColumns / static_cast<float>(width_px_)), 0,
                     kCellColumns - 1);
      const int row = std::clamp(static_cast<int>(p.y * kCellRows / static_cast<float>(height_px_)),
                                 0, kCellRows - 1);
      ++counts[static_cast<size_t>(row)][static_cast<size_t>(column)];
    }
  }
  return counts;
}

double ViewCollector::coverage() const {
  int covered = 0;
  for (const std::vector<int>& row : corners_per_cell()) {
    covered += static_cast<int>(std::count_if(row.begin(), row.end(), [](int n) { return n > 0; }));
  }
  return static_cast<double>(covered) / (kCellColumns * kCellRows);
}

std::string ViewCollector::emptiest_part() const {
  static constexpr const char* kParts[2][2] = {{"the upper left", "the upper right"},
                                               {"the lower left", "the lower right"}};
  int empty[2][2] = {};
  const auto counts = corners_per_cell();
  for (size_t row = 0; row < kCellRows; ++row) {
    for (size_t column = 0; column < kCellColumns; ++column) {
      if (counts[row][column] == 0) ++empty[2 * row / kCellRows][2 * column / kCellColumns];
    }
  }
  int most = 0;
  std::string part;
  for (int row = 0; row < 2; ++row) {
    for (int column = 0; column < 2; ++column) {
      if (empty[row][column] <= most) continue;
      most = empty[row][column];
      part = kParts[row][column];
    }
  }
  return part;
}

Calibration calibrate_lens(const std::vector<BoardView>& views, int width_px, int height_px,
                           LensModel lens) {
  if (views.size() < kMinViews) {
    throw UnavailableError("the board was found in " + std::to_string(views.size()) +
                           " sufficiently different places, need " + std::to_string(kMinViews) +
                           ": move it about, tilt it, come near and go far");
  }
  std::vector<BoardView> fitted, held_out;
  for (size_t i = 0; i < views.size(); ++i) {
    (i % kHoldOutEvery == kHoldOutEvery - 1 ? held_out : fitted).push_back(views[i]);
  }
  const cv::Size size(width_px, height_px);
  Calibration result;
  Fit best = fit(fitted, size, lens);
  std::vector<double> errors = errors_of(fitted, best, lens), sorted = errors;
  std::sort(sorted.begin(), sorted.end());
  const double limit = std::max(kOutlierFloor_px, kOutlierRatio * sorted[sorted.size() / 2]);
  std::vector<BoardView> kept;
  for (size_t i = 0; i < fitted.size(); ++i) {
    if (errors[i] <= limit) kept.push_back(fitted[i]);
  }
  result.dropped_views = static_cast<int>(fitted.size() - kept.size());
  if (result.dropped_views > 0) {
    best = fit(kept, size, lens);
    errors = errors_of(kept, best, lens);
  }
  result.camera = camera_of(best, size, lens);
  result.views = static_cast<int>(kept.size());
  result.held_out_views = static_cast<int>(held_out.size());
  result.rms_px = rms(errors);
  result.held_out_rms_px = rms(errors_of(held_out, best, lens));
  result.focal_sigma = best.focal_sigma;
  return result;
}

std::string camera_file_text(const Calibration& calibration) {
  const CameraModel& c = calibration.camera;
  const bool fisheye = c.lens == LensModel::kEquidistant;
  std::ostringstream text;
  text.precision(10);
  text << "# " << calibration.views << " views, " << calibration.rms_px << " px rms; on "
       << calibration.held_out_views << " others " << calibration.held_out_rms_px << " px\n"
       << "model: " << (fisheye ? "equidistant" : "pinhole_radtan") << "\n"
       << "width: " << c.width_px << "\nheight: " << c.height_px << "\nfx: " << c.fx_px
       << "\nfy: " << c.fy_px << "\ncx: " << c.cx_px << "\ncy: " << c.cy_px << "\n";
  const std::array<const char*, 5> keys =
      fisheye ? std::array{"k1", "k2", "k3", "k4", ""} : std::array{"k1", "k2", "p1", "p2", "k3"};
  for (size_t i = 0; i < (fisheye ? 4u : 5u); ++i) {
    text << keys[i] << ": " << c.distortion[i] << "\n";
  }
  return text.str();
}

}  // namespace foresight
