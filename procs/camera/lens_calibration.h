// Lens calibration from views of a flat target: intrinsics and distortion, how sure they are, and
// what to film in addition. OpenCV does the detection and the fit; what makes a calibration good or
// bad (which views, outliers, hold-out, coverage) is decided here.
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/camera_model.h"

namespace foresight {

struct CalibrationBoard {
  enum class Kind { kChessboard, kAprilTags };
  Kind kind = Kind::kChessboard;
  int columns = 9, rows = 6;  // inner corners of a chessboard; tags of a grid (family 36h11)
  double spacing_m = 0.025;   // square; side of a tag
  double gap_m = 0;           // between tags
};

/// Corners of the board seen in one image. Pixels: the centre of the first is (0, 0).
struct BoardView {
  std::vector<cv::Point3f> points_m;  // on the board, z = 0
  std::vector<cv::Point2f> pixels;    // the same number
};

/// Empty if the board is not there, or too little of it (12 corners).
std::optional<BoardView> find_board(const cv::Mat& gray, const CalibrationBoard& board);

/// Keeps views that show something new: far enough from every view kept before.
class ViewCollector {
 public:
  ViewCollector(int width_px, int height_px) : width_px_(width_px), height_px_(height_px) {}
  bool add(BoardView view);  // true if kept
  const std::vector<BoardView>& views() const { return views_; }
  /// Share of 8 × 6 image cells that hold a corner.
  double coverage() const;
  /// The part of the image with the emptiest cells, in words: "the lower left"; empty if all is
  /// covered.
  std::string emptiest_part() const;

 private:
  std::vector<std::vector<int>> corners_per_cell() const;
  int width_px_, height_px_;
  std::vector<BoardView> views_;
};

struct Calibration {
  CameraModel camera;
  int views = 0, dropped_views = 0, held_out_views = 0;
  double rms_px = 0;           // over the views fitted
  double held_out_rms_px = 0;  // over views that were not: the honest figure
  double focal_sigma = 0;      // standard deviation / focal length; 0 for a fisheye (not known)
};

/// Fits to three of four views, drops views that fit worse than three times the median, and tests
/// on the rest. Throws UnavailableError if there are fewer than 8 views or the fit fails.
Calibration calibrate_lens(const std::vector<BoardView>& views, int width_px, int height_px,
                           LensModel lens);

/// The camera file's text, as load_camera_file() reads it, with the figures as comments.
std::string camera_file_text(const Calibration& calibration);

}  // namespace foresight
