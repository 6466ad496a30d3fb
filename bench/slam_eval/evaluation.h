// Runs the SLAM core over a sequence, one image after the other with mapping inline, and scores its
// live poses against the truth after a Sim(3) alignment (Umeyama).
#pragma once

#include <string>
#include <vector>

#include "bench/slam_eval/depth_check.h"
#include "bench/slam_eval/sequence.h"
#include "common/frames.h"
#include "procs/slam/slam.h"

namespace foresight {

/// One answer of the core that carries a pose: placed, or the guess while lost.
struct PlacedImage {
  Time time;
  TrackingState state = TrackingState::kTracking;
  int epoch = 0;
  Pose<Map, Cam> map_from_cam;
  double quality = 0;
};

struct Evaluation {
  std::string sequence;
  int frames = 0;
  std::vector<PlacedImage> placed;
  std::vector<PlacedImage> lost;
  double tracked_fraction = 0;
  int first_frame = -1;    // first with a pose
  double init_s = -1;      // its time since the first image
  double ate_rmse_m = -1;  // of the epoch with the most poses; −1 without truth
  double ate_max_m = -1;
  int wrong_by_10_cm = 0;  // of the placed
  // Is a mistrack recognisable? Qualities of placed images within 5 cm, and of all answers (lost
  // ones too) that are off by more than 10 cm; −1: there was none.
  double right_quality_p05 = -1;
  double wrong_quality_max = -1;
  double track_ms_median = 0, track_ms_p95 = 0;
  double job_ms_median = 0, job_ms_max = 0;
  int jobs = 0;
  SlamStatistics statistics;
  DepthCheck depth;
  double peak_mb = 0;
  std::vector<Eigen::Vector3d> truth_path, estimated_path;  // aligned, m
};

Similarity<World, Map> align_umeyama(const std::vector<Eigen::Vector3d>& points_in_map,
                                     const std::vector<Eigen::Vector3d>& points_in_world);

struct EvaluationRange {
  int start = 0;
  int frames = -1;  // all
  int step = 1;     // every so many images: a faster camera
  bool verbose = false;
  double depth_scale = 0;  // metres per unit of registered depth images; 0: no check
};
Evaluation evaluate(const Sequence& sequence, const SlamOptions& options,
                    const EvaluationRange& range);

}  // namespace foresight
