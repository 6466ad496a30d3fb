// Runs the SLAM core over a sequence, one image after the other with mapping inline, and scores its
// live poses against the truth after a Sim(3) alignment (Umeyama).
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "bench/slam_eval/depth_check.h"
#include "bench/slam_eval/depth_transfer.h"
#include "bench/slam_eval/playlist.h"
#include "bench/slam_eval/sequence.h"
#include "bench/slam_eval/timeline.h"
#include "common/frames.h"
#include "procs/camera/input_report.h"
#include "procs/slam/slam.h"

namespace foresight {

/// The core's answer to one image.
struct Answer {
  PlayedImage played;
  Time image_time;  // of the original image: the truth's
  TrackingState state = TrackingState::kInitialising;
  int epoch = 0;
  Pose<Map, Cam> map_from_cam;
  double quality = 0;
  std::optional<double>
      error_m;  // of the position, aligned; of the best epoch, where there is truth
};

/// How the core comes back after black-outs or jumps.
struct Recovery {
  int disturbances = 0;
  int returned = 0;         // placed again before the next one, within 5 cm
  int within_half_s = 0;    // of these, in ≤ 0.5 s
  double slowest_s = 0;     // of the returned
  int placed_in_black = 0;  // poses called good while the image was black
};

/// Placed images whose quality is in a range, and how right they are.
struct QualityBin {
  double from = 0, to = 0;
  int images = 0;
  double error_m_median = 0, error_m_p95 = 0;
  int wrong_by_5_cm = 0;
};

struct Evaluation {
  std::string sequence, degradation;
  int frames = 0;                  // shown to the core
  InputReport input, depth_input;  // what of the images could be used, and what not
  double focal_px = 0;             // that the core was given
  bool intrinsics_are_guessed = false;
  int truth_images = 0;  // images of the sequence that have a truth
  std::vector<Answer> answers;
  double tracked_fraction = 0;  // of all images, those that could not be used included
  int first_frame = -1;         // first with a pose
  double init_s = -1;           // its time since the first image
  double ate_rmse_m = -1;       // of the epoch with the most poses; −1 without truth
  double ate_max_m = -1;
  double rpe_rmse_m = -1, rpe_rmse_deg = -1;  // over 1 s
  int wrong_by_5_cm = 0, wrong_by_10_cm = 0;  // of the placed
  // Is a mistrack recognisable? Qualities of placed images within 5 cm, and of all answers (lost
  // ones too) that are off by more than 10 cm; −1: there was none.
  double right_quality_p05 = -1;
  double wrong_quality_max = -1;
  std::vector<QualityBin> quality_bins;
  double track_ms_median = 0, track_ms_p95 = 0, track_ms_max = 0;
  double job_ms_median = 0, job_ms_max = 0;
  int jobs = 0;
  SlamStatistics statistics;
  // At half time, to tell growth from what a scene needs.
  int keyframes_at_half = 0, points_at_half = 0;
  double track_ms_first_tenth = 0, track_ms_last_tenth = 0;  // medians
  std::vector<Minute> minutes;
  std::string warning;
  Recovery recovery;
  DepthCheck depth;
  /// Of our live poses, and of the truth itself, over half a second (depth_transfer.h).
  DepthTransfer transfer, truth_transfer;
  double peak_mb = 0;
  std::string not_saved;  // why; empty if the map was saved or was not to be
  StoredMap map;          // in the end
  uint64_t hash = 0;      // of all poses and of the final map: equal bytes, equal hash
  std::vector<Eigen::Vector3d> truth_path, estimated_path;  // aligned, m
  std::optional<Similarity<World, Map>> world_from_map;     // what aligned them
};

Similarity<World, Map> align_umeyama(const std::vector<Eigen::Vector3d>& points_in_map,
                                     const std::vector<Eigen::Vector3d>& points_in_world);

struct EvaluationRange {
  PlayRange play;
  Degradation degradation;
  bool verbose = false;
  std::string save_folder;  // for the map and the trajectory; empty: not saved
  double focal_factor = 1;  // of the focal length that the core is given: a wrong camera file
  /// Told after each image what changed in the map, for what follows slam in the line.
  std::function<void(const Answer&, const MapDelta&)> on_delta = nullptr;
};
/// Images that cannot be used are left out and counted; throws UnavailableError if none can.
Evaluation evaluate(const Sequence& sequence, const SlamOptions& options,
                    const EvaluationRange& range);

/// What of the sequence could not be used, or not be saved, in one line; empty if all was.
std::string complaint(const Evaluation& evaluation);

/// The live poses of an epoch at the times of the depth images, which may lie between two images.
std::map<Time, Pose<Map, Cam>> poses_at_depth_images(const Sequence& sequence,
                                                     const Evaluation& evaluation, int epoch);

/// Of several runs: the medians of times and memory; the rest is the first run's. Throws
/// UnavailableError if the runs' hashes differ.
Evaluation median_of(const std::vector<Evaluation>& runs);

}  // namespace foresight
