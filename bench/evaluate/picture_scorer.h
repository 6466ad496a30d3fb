// Scores one instant: the delayed video, its best homography and the predicted view, each against
// the picture that was really there. All pictures are distortion-free RGB. Only pixels that the
// truth has are scored: an undistorted picture has a black rim where its lens saw nothing, which
// every view would be told to show.
//
//   PictureScorer scorer(5);                     // keep five rows of pictures
//   scorer.score(truth, shown, predicted_frame, points_in_map);
//   scorer.finish(&scores);
#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bench/evaluate/homography_baseline.h"
#include "common/camera_model.h"
#include "common/frames.h"
#include "procs/renderer/process.h"

namespace foresight {

/// Of one way of showing the scene, over all scored frames.
struct DisplayScore {
  // Per frame: over the pixels that all three have, over those of them that show a measured
  // surface, and over the whole picture.
  std::vector<double> psnr_common_db, psnr_measured_db, psnr_whole_db;
  std::vector<double> ssim_common, ssim_whole;  // per frame
  std::vector<double> displacement_px;          // of all features of all frames
  double mean_psnr_common_db() const;
  double mean_psnr_measured_db() const;
  double mean_psnr_whole_db() const;
  double mean_ssim_common() const;
  double mean_ssim_whole() const;
};

struct PictureScores {
  int scored_frames = 0;
  DisplayScore delayed, homography, predicted;
  double truth_share = 0;  // mean share of the pixels that the truth has
  double coverage = 0;     // mean share of the predicted view's pixels that an image painted
  double measured = 0;  // of all pixels: painted on a surface between map points; the rest of the
                        // coverage is painted on guessed surface (bounding hull, background)
  std::vector<cv::Mat> grid_rows;  // truth, delayed, homography, predicted, error
};

/// The delayed video as it was shown.
struct ShownVideo {
  Time time;
  MaskedPicture picture;  // empty before the first frame
  std::optional<Pose<Map, Cam>> map_from_cam;
  int64_t epoch = 0;
};

/// Removes lens distortion by bilinear sampling, and says what the lens did not see.
class Undistorter {
 public:
  explicit Undistorter(const CameraModel& camera);
  MaskedPicture operator()(const cv::Mat& rgb) const;

 private:
  CameraModel camera_;
  cv::Mat map_x_, map_y_, seen_;
};

cv::Mat to_mat(const Image& rgb);
/// A picture that has all its pixels.
MaskedPicture whole(const cv::Mat& rgb);

/// Where the pictures of one instant are compared.
struct ScoredPixels {
  cv::Mat truth;     // the truth has them
  cv::Mat common;    // of these: all views have them
  cv::Mat measured;  // of these: on measured surface
};
/// Adds one view's scores.
void add_scores(const cv::Mat& view, const cv::Mat& truth, const ScoredPixels& pixels,
                DisplayScore* score);

class PictureScorer {
 public:
  explicit PictureScorer(int grid_rows) : grid_rows_(grid_rows) {}
  void score(const MaskedPicture& truth, const ShownVideo& shown, const PredictedFrame& frame,
             const std::vector<Eigen::Vector3d>& points_in_map);
  void finish(PictureScores* scores);

 private:
  void keep_row(const cv::Mat& truth, const cv::Mat& delayed, const cv::Mat& warped,
                const cv::Mat& predicted);

  int grid_rows_;
  PictureScores scores_;
  std::vector<double> truth_share_, coverage_, measured_;
  std::vector<cv::Mat> grid_;
};

}  // namespace foresight
