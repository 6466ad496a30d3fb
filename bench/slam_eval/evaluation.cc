#include "bench/slam_eval/evaluation.h"

#include <sys/resource.h>
#include <time.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "common/errors.h"

namespace foresight {
namespace {

double cpu_ms() {  // of this thread
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(q * static_cast<double>(values.size() - 1))];
}

double peak_mb() {
  rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

void print_frame(size_t index, const TrackingResult& r) {
  static constexpr const char* kStates[] = {"init", "track", "LOST"};
  std::printf("%4zu %-5s q %.2f found %3d of %3d%s%s %s\n", index,
              kStates[static_cast<int>(r.state)], r.quality, r.points_found, r.points_predicted,
              r.is_keyframe ? " keyframe" : "", r.relocalised ? " relocalised" : "",
              r.reason.c_str());
}

void judge_quality(const Sequence& sequence, const Similarity<World, Map>& world_from_map,
                   int epoch, Evaluation* e) {
  std::vector<double> right;
  for (const auto* answers : {&e->placed, &e->lost}) {
    for (const PlacedImage& p : *answers) {
      const auto truth = sequence.truth_at(p.time);
      if (p.epoch != epoch || !truth) continue;
      const double error =
          (world_from_map * p.map_from_cam.translation() - truth->translation()).norm();
      if (error < 0.05 && p.state == TrackingState::kTracking) right.push_back(p.quality);
      if (error > 0.1) e->wrong_quality_max = std::max(e->wrong_quality_max, p.quality);
    }
  }
  if (!right.empty()) e->right_quality_p05 = quantile(std::move(right), 0.05);
}

void score(const Sequence& sequence, Evaluation* e) {
  std::map<int, int> per_epoch;
  for (const PlacedImage& p : e->placed) ++per_epoch[p.epoch];
  int best_epoch = -1;
  for (const auto& [epoch, count] : per_epoch) {
    if (best_epoch < 0 || count > per_epoch[best_epoch]) best_epoch = epoch;
  }
  std::vector<Eigen::Vector3d> in_map;
  for (const PlacedImage& p : e->placed) {
    const auto truth = sequence.truth_at(p.time);
    if (p.epoch != best_epoch || !truth) continue;
    in_map.push_back(p.map_from_cam.translation());
    e->truth_path.push_back(truth->translation());
  }
  if (in_map.size() < 3) return;
  const Similarity<World, Map> world_from_map = align_umeyama(in_map, e->truth_path);
  double squared = 0;
  for (size_t i = 0; i < in_map.size(); ++i) {
    e->estimated_path.push_back(world_from_map * in_map[i]);
    const double error = (e->estimated_path[i] - e->truth_path[i]).norm();
    squared += error * error;
    e->ate_max_m = std::max(e->ate_max_m, error);
    if (error > 0.1) ++e->wrong_by_10_cm;
  }
  e->ate_rmse_m = std::sqrt(squared / static_cast<double>(in_map.size()));
  judge_quality(sequence, world_from_map, best_epoch, e);
}

// The delta after an image that became a keyframe names it: its newest new keyframe.
void note_keyframe(const MapDelta& delta, Time time, std::map<int32_t, Time>* times) {
  for (auto k = delta.keyframes_set.rbegin(); k != delta.keyframes_set.rend(); ++k) {
    if (times->empty() || k->id > times->rbegin()->first) (*times)[k->id] = time;
  }
}

void note_pose(const TrackingResult& r, int frame, Duration since_start, Evaluation* e) {
  ++e->frames;
  if (r.state == TrackingState::kLost) {
    e->lost.push_back({r.time, r.state, r.epoch, r.map_from_cam, r.quality});
  }
  if (r.state != TrackingState::kTracking) return;
  if (e->first_frame < 0) {
    e->first_frame = frame;
    e->init_s = since_start.seconds();
  }
  e->placed.push_back({r.time, r.state, r.epoch, r.map_from_cam, r.quality});
}

void summarise_times(const std::vector<double>& track_ms, const std::vector<double>& job_ms,
                     Evaluation* e) {
  e->tracked_fraction = static_cast<double>(e->placed.size()) / std::max(1, e->frames);
  e->track_ms_median = quantile(track_ms, 0.5);
  e->track_ms_p95 = quantile(track_ms, 0.95);
  e->job_ms_median = quantile(job_ms, 0.5);
  e->job_ms_max = quantile(job_ms, 1.0);
  e->jobs = static_cast<int>(job_ms.size());
  e->peak_mb = peak_mb();
}

std::map<Time, Pose<Map, Cam>> live_poses(const Evaluation& e, int epoch) {
  std::map<Time, Pose<Map, Cam>> poses;
  for (const PlacedImage& p : e.placed) {
    if (p.epoch == epoch) poses[p.time] = p.map_from_cam;
  }
  return poses;
}

}  // namespace

Similarity<World, Map> align_umeyama(const std::vector<Eigen::Vector3d>& points_in_map,
                                     const std::vector<Eigen::Vector3d>& points_in_world) {
  const auto n = static_cast<Eigen::Index>(points_in_map.size());
  Eigen::Matrix3Xd from(3, n), to(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    from.col(i) = points_in_map[static_cast<size_t>(i)];
    to.col(i) = points_in_world[static_cast<size_t>(i)];
  }
  const Eigen::Matrix4d m = Eigen::umeyama(from, to, true);
  const double scale = m.topLeftCorner<3, 3>().col(0).norm();
  const Eigen::Matrix3d rotation = m.topLeftCorner<3, 3>() / scale;
  return {scale, Eigen::Quaterniond(rotation), m.topRightCorner<3, 1>()};
}

Evaluation evaluate(const Sequence& sequence, const SlamOptions& options,
                    const EvaluationRange& range) {
  Evaluation e;
  e.sequence = sequence.name;
  Slam slam(sequence.camera, options);
  std::vector<double> track_ms, job_ms;
  std::map<int32_t, Time> keyframe_times;
  const auto begin = static_cast<size_t>(range.start);
  for (size_t i = begin; i < sequence.images.size(); i += static_cast<size_t>(range.step)) {
    if (range.frames >= 0 && i >= begin + static_cast<size_t>(range.frames)) break;
    const SequenceImage& entry = sequence.images[i];
    const cv::Mat image = cv::imread(entry.path, cv::IMREAD_GRAYSCALE);
    if (image.empty()) throw UnavailableError(entry.path + ": cannot be read as an image");
    const double start_ms = cpu_ms();
    const TrackingResult r = slam.track(
        entry.time, {image.data, image.cols, image.rows, static_cast<int>(image.step[0])});
    track_ms.push_back(cpu_ms() - start_ms);
    if (range.verbose) print_frame(i, r);
    note_pose(r, static_cast<int>(i - begin), entry.time - sequence.images[begin].time, &e);
    while (auto job = slam.take_job()) {
      const double job_start_ms = cpu_ms();
      slam.apply(Slam::run(std::move(*job)));
      job_ms.push_back(cpu_ms() - job_start_ms);
    }
    const MapDelta delta = slam.take_delta();
    if (r.is_keyframe) note_keyframe(delta, entry.time, &keyframe_times);
  }
  summarise_times(track_ms, job_ms, &e);
  e.statistics = slam.statistics();
  score(sequence, &e);
  if (range.depth_scale > 0) {
    e.depth = check_depth(sequence, slam.snapshot(), keyframe_times, live_poses(e, slam.epoch()),
                          range.depth_scale);
  }
  return e;
}

}  // namespace foresight
