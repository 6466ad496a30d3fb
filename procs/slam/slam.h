// Monocular keyframe SLAM (paper §II-A: "tracking every frame, mapping beside it"). A pure library:
// no messages, no clock, no files, no threads. docs/algorithms/slam.md explains the steps.
//
//   Slam slam(camera, SlamOptions{});
//   for each image:
//     TrackingResult result = slam.track(time, view);            // main thread, about 5–10 ms
//     if (worker is idle)                                         // slow work beside tracking
//       if (auto job = slam.take_job()) worker.start([job] { return Slam::run(job); });
//     if (worker is done) slam.apply(worker.result());            // main thread
//     if (slam.epoch() != sent_epoch) …;        // the map restarted: receivers drop theirs
//     MapDelta delta = slam.take_delta();       // what the carver has to learn
//
// In replay: `while (auto job = slam.take_job()) slam.apply(Slam::run(std::move(*job)));` after
// each track(): the same images then give the same bytes.
//
// Units: map units (mu; median depth of the first map = 1), pixels of the given image with the
// centre of the first pixel at (0, 0). Errors are values: an image of the wrong size is answered
// with the current state and a reason, and is otherwise ignored.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "common/camera_model.h"
#include "common/frames.h"
#include "common/map_delta.h"
#include "common/time.h"
#include "procs/slam/gray_image_view.h"
#include "procs/slam/slam_options.h"
#include "procs/slam/stored_map.h"

namespace foresight {

namespace slam {
class MappingTask;
}  // namespace slam

enum class TrackingState {
  kInitialising,  // no map yet: waits for enough parallax
  kTracking,      // map_from_cam is good
  kLost,          // there is a map, but this image was not placed in it; map_from_cam is a guess
};

struct TrackingResult {
  Time time;  // of the image
  TrackingState state = TrackingState::kInitialising;
  Pose<Map, Cam> map_from_cam;  // valid while kTracking
  /// 0…1: points found, relative to how many this map's history lets us expect. About 0.6–1 on a
  /// good frame; below SlamOptions::min_quality the frame is declared lost.
  double quality = 0;
  int points_predicted = 0;  // searched for in this image
  int points_found = 0;      // found and consistent with the pose
  std::string reason;        // why initialising or lost: "parallax 0.4 deg, need 1.0"
  bool is_keyframe = false;
  bool relocalised = false;  // this frame ended a loss, or was found to be of another place
  double lost_s = -1;        // how long the loss lasted or lasts; −1: there was none
  int epoch = 0;
};

/// Counters since construction, for health and reports.
struct SlamStatistics {
  int keyframes = 0;         // in the map now
  int points = 0;            // in the map now, those on probation included
  int published_points = 0;  // known to the receivers of the deltas
  int losses = 0;
  int relocalisations = 0;
  int restarts = 0;
  int loops = 0;                // closed
  int forgotten_keyframes = 0;  // of this map, because of the memory limit
  double memory_mb = 0;         // of this map: estimate
  // The last check of the focal length, from the map itself; 1 before there was one.
  double focal_factor = 1;      // as it fits best / as the camera file gives it
  double focal_cost_ratio = 1;  // cost of the map with the best factor / with the given one
};

/// Slow work: owns copies of all it needs. Opaque; move it to Slam::run() on any thread.
class MappingJob {
 public:
  MappingJob(int job_epoch, std::unique_ptr<slam::MappingTask> job_task);
  MappingJob(MappingJob&&) noexcept;
  MappingJob& operator=(MappingJob&&) noexcept;
  ~MappingJob();
  /// What it usually costs, in bundle adjustments (about 50 ms).
  double relative_cost() const;

  int epoch;
  std::unique_ptr<slam::MappingTask> task;
};

/// A job that has been run.
class MappingResult {
 private:
  friend class Slam;
  explicit MappingResult(MappingJob done) : job_(std::move(done)) {}
  MappingJob job_;
};

class Slam {
 public:
  Slam(const CameraModel& camera, const SlamOptions& options);
  ~Slam();

  /// Places one image. Times must increase; a repeated or older one is answered and ignored, unless
  /// it is older by more than a second: then the camera's clock was set anew.
  [[nodiscard]] TrackingResult track(Time time, const GrayImageView& image);

  /// Where the camera should be at about this time, by other means (an arm's joints): a lost camera
  /// is looked for there first. Not believed more than any other guess, and never needed.
  void hint(Time time, const Pose<Map, Cam>& map_from_cam);

  /// What changed in the published map since the last call. Points on probation are not in it;
  /// moves below SlamOptions::delta_threshold_px as seen from their keyframes are held back.
  [[nodiscard]] MapDelta take_delta();
  /// The whole map as a receiver of all deltas of this epoch knows it.
  [[nodiscard]] MapDelta snapshot() const;
  /// The whole map, those on probation included; images are shared.
  StoredMap stored_map() const;
  /// Takes a stored map of the same camera in the place of the present one: a new epoch, lost until
  /// an image is found in it. Such a map is never given up by itself.
  void restore(const StoredMap& stored);
  /// Changes when the map restarts. The deltas of a new epoch start from an empty map.
  int epoch() const;
  /// Forgets the map and initialises again; the next results carry `reason` until there is news.
  void reset(const std::string& reason);

  /// The next piece of slow work, if there is any. Ask only while none is running.
  [[nodiscard]] std::optional<MappingJob> take_job();
  [[nodiscard]] static MappingResult run(MappingJob job);  // pure; any thread; ≤ about 300 ms
  void apply(MappingResult result);  // tolerates a map that changed or restarted since

  SlamStatistics statistics() const;
  /// What is wrong though it tracks, for people; empty if nothing is known to be: the map says that
  /// the focal length is not as given, or memory is short.
  std::string warning() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace foresight
