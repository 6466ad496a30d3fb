// Scores one instant: the delayed video, its best homography and the predicted view, each against
// the picture that was really there. All pictures are distortion-free RGB.
//
//   PictureScorer scorer(camera, 5);
//   scorer.score(truth, shown, predicted_frame, points_in_map);
//   scorer.finish(&scores);
#pragma once

#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

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
  double coverage = 0;  // mean share of the predicted view's pixels that an image painted
  double measured = 0;  // of all pixels: painted on a surface between map points; the rest of the
                        // coverage is painted on guessed surface (bounding hull, background)
  std::vector<cv::Mat> grid_rows;  // truth, delayed, homography, predicted, error
};

/// The delayed video as it was shown.
struct ShownVideo {
  Time time;
  cv::Mat rgb;  // empty before the first frame
  std::optional<Pose<Map, Cam>> map_from_cam;
  int64_t epoch = 0;
};

/// Removes lens distortion by bilinear sampling.
class Undistorter {
 public:
  explicit Undistorter(const CameraModel& camera);
  cv::Mat operator()(const cv::Mat& rgb) const;

 private:
  CameraModel camera_;
  cv::Mat map_x_, map_y_;
};

cv::Mat to_mat(const Image& rgb);

class PictureScorer {
 public:
  explicit PictureScorer(int grid_rows) : grid_rows_(grid_rows) {}
  void score(const cv::Mat& truth, const ShownVideo& shown, const PredictedFrame& frame,
             const std::vector<Eigen::Vector3d>& points_in_map);
  void finish(PictureScores* scores);

 private:
  void add(const cv::Mat& view, const cv::Mat& truth, const cv::Mat& common,
           const cv::Mat& measured, DisplayScore* score);
  void keep_row(const cv::Mat& truth, const cv::Mat& delayed, const cv::Mat& warped,
                const cv::Mat& predicted);

  int grid_rows_;
  PictureScores scores_;
  std::vector<double> coverage_, measured_;
  std::vector<cv::Mat> grid_;
};

}  // namespace foresight
