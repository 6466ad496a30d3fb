// Scores what the operator saw on recorded video against what was there: for every frame after the
// first prediction, the delayed frame, the delayed frame warped by the best homography, and the
// predicted view, each against the undelayed frame of the same instant.
#pragma once

#include <functional>
#include <string>

#include "bench/evaluate/picture_scorer.h"
#include "sim/swarm/recorded_line.h"

namespace foresight {

struct EvaluationResult : PictureScores {
  std::string sequence;
  double delay_s = 0;
  int frames = 0;                 // published by the camera
  int frames_after_init = 0;      // since the first prediction
  int predicted_frames = 0;       // of these, with a predicted view; every Nth is scored
  double first_prediction_s = 0;  // after the first frame
  int map_points = 0, keyframes = 0, triangles = 0;
  InputReport input;    // which images were used and which could not be
  double focal_px = 0;  // of the published images
  bool intrinsics_are_guessed = false;
};

struct ScoringOptions {
  int every = 3;      // score each Nth frame
  int grid_rows = 5;  // pictures kept, evenly spread
};

/// Runs the line to its end. `progress` is called now and then.
EvaluationResult evaluate(const RecordedLineOptions& line, const ScoringOptions& scoring,
                          const std::function<void(int frames, int scored)>& progress);

}  // namespace foresight
