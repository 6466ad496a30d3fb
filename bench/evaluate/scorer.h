// Scores what the operator saw against what was there: for every frame after the first prediction,
// the delayed frame, the delayed frame warped by the best homography, and the predicted view, each
// against the undelayed frame of the same instant. All pictures are distortion-free.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bench/evaluate/recorded_line.h"
#include "common/camera_model.h"
#include "common/map_delta.h"

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

struct EvaluationResult {
  std::string sequence;
  double delay_s = 0;
  int frames = 0;                 // published by the camera
  int frames_after_init = 0;      // since the first prediction
  int predicted_frames = 0;       // of these, with a predicted view
  int scored_frames = 0;          // of these, scored (every Nth)
  double first_prediction_s = 0;  // after the first frame
  DisplayScore delayed, homography, predicted;
  double coverage = 0;  // mean share of the predicted view's pixels that an image painted
  double measured = 0;  // of all pixels: painted on a surface between map points; the rest of the
                        // coverage is painted on guessed surface (bounding hull, background)
  int map_points = 0, keyframes = 0, triangles = 0;
  std::vector<cv::Mat> grid_rows;  // truth, delayed, homography, predicted, error
};

struct ScoringOptions {
  int every = 3;      // score each Nth frame
  int grid_rows = 5;  // pictures kept, evenly spread
};

/// Runs the line to its end. `progress` is called with the share done, 0…1 (unknown length: −1).
EvaluationResult evaluate(const RecordedLineOptions& line, const ScoringOptions& scoring,
                          const std::function<void(int frames, int scored)>& progress);

}  // namespace foresight
