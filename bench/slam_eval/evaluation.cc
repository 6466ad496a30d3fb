#include "bench/slam_eval/evaluation.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <utility>

#include "bench/slam_eval/score.h"
#include "common/cpu_time.h"
#include "common/errors.h"
#include "common/fnv.h"
#include "common/output_file.h"
#include "common/peak_memory.h"
#include "procs/slam/map_folder.h"

namespace foresight {
namespace {

void add_pose(const Pose<Map, Cam>& pose, Fnv1a* hash) {
  for (const double x : pose.rotation().coeffs()) hash->add_value(x);
  for (const double x : pose.translation()) hash->add_value(x);
}

uint64_t hash_of(const std::vector<Answer>& answers, const MapDelta& snapshot) {
  Fnv1a hash;
  for (const Answer& a : answers) {
    hash.add_value(static_cast<int>(a.state));
    add_pose(a.map_from_cam, &hash);
  }
  for (const MapKeyframe& k : snapshot.keyframes_set) add_pose(k.map_from_cam, &hash);
  for (const MapPoint& p : snapshot.points_set) {
    hash.add_value(p.id.value());
    for (const float x : p.position_in_map) hash.add_value(x);
  }
  for (const MapObservation& o : snapshot.observations_added) {
    hash.add_value(o.keyframe_id.value());
    hash.add_value(o.point_id.value());
  }
  return hash.value();
}

void print_frame(const Answer& a, const TrackingResult& r, double ms) {
  static constexpr const char* kStates[] = {"init", "track", "LOST"};
  std::printf("%4zu %-5s q %.2f found %3d of %3d %5.1f ms%s%s %s\n", a.played.index,
              kStates[static_cast<int>(r.state)], r.quality, r.points_found, r.points_predicted, ms,
              r.is_keyframe ? " keyframe" : "", r.relocalised ? " relocalised" : "",
              r.reason.c_str());
}

// The delta after an image that became a keyframe names it: its newest new keyframe.
void note_keyframe(const MapDelta& delta, Time time, std::map<KeyframeId, Time>* times) {
  for (auto k = delta.keyframes_set.rbegin(); k != delta.keyframes_set.rend(); ++k) {
    if (times->empty() || k->id > times->rbegin()->first) (*times)[k->id] = time;
  }
}

std::map<Time, Pose<Map, Cam>> live_poses(const Evaluation& e, int epoch) {
  std::map<Time, Pose<Map, Cam>> poses;
  for (const Answer& a : e.answers) {
    if (a.state == TrackingState::kTracking && a.epoch == epoch)
      poses[a.image_time] = a.map_from_cam;
  }
  return poses;
}

void compare_transfer(const Sequence& sequence, const std::map<Time, Pose<Map, Cam>>& poses,
                      Evaluation* e) {
  const Similarity<World, Map> metric(e->depth.metres_per_mu, Eigen::Quaterniond::Identity(),
                                      Eigen::Vector3d::Zero());
  const auto estimate = [&](Time time) -> std::optional<Pose<World, Cam>> {
    const auto it = poses.lower_bound(time - milliseconds(5));
    if (it == poses.end() || it->first - time > milliseconds(20)) return std::nullopt;
    return metric * it->second;
  };
  const auto truth = [&](Time time) { return sequence.truth_at(time); };
  const auto results = transfer_through_depth(sequence, milliseconds(500), {estimate, truth});
  e->transfer = results[0];
  e->truth_transfer = results[1];
}

// The map as a folder, and the live poses in TUM's format (camera to map, map units; "time tx ty tz
// qx qy qz qw"), those of the last epoch.
void save(const Slam& slam, const Evaluation& e, const std::string& folder) {
  std::filesystem::create_directories(folder);
  write_map_folder(slam.stored_map(), folder + "/map");
  std::string text = "# timestamp tx ty tz qx qy qz qw\n";
  for (const Answer& a : e.answers) {
    if (a.state != TrackingState::kTracking || a.epoch != slam.epoch()) continue;
    const Eigen::Vector3d& t = a.map_from_cam.translation();
    const Eigen::Quaterniond& q = a.map_from_cam.rotation();
    char line[200];
    std::snprintf(line, sizeof line, "%.6f %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n",
                  static_cast<double>(a.played.time.us) * 1e-6, t.x(), t.y(), t.z(), q.x(), q.y(),
                  q.z(), q.w());
    text += line;
  }
  write_output(folder + "/trajectory.txt", text);
}

void note_times(const std::vector<double>& track_ms, const std::vector<double>& job_ms,
                Evaluation* e) {
  e->track_ms_median = quantile(track_ms, 0.5);
  e->track_ms_p95 = quantile(track_ms, 0.95);
  e->track_ms_max = quantile(track_ms, 1.0);
  const auto tenth = static_cast<std::ptrdiff_t>((track_ms.size() + 9) / 10);
  e->track_ms_first_tenth = quantile({track_ms.begin(), track_ms.begin() + tenth}, 0.5);
  e->track_ms_last_tenth = quantile({track_ms.end() - tenth, track_ms.end()}, 0.5);
  e->job_ms_median = quantile(job_ms, 0.5);
  e->job_ms_max = quantile(job_ms, 1.0);
  e->jobs = static_cast<int>(job_ms.size());
}

void note_errors_by_minute(Timeline& timeline, Evaluation* e) {
  std::map<int, std::pair<double, int>> squared;  // minute: sum, count
  for (const Answer& a : e->answers) {
    if (!a.error_m || a.state != TrackingState::kTracking) continue;
    auto& [sum, count] = squared[timeline.minute_of(a.played.time)];
    sum += *a.error_m * *a.error_m;
    ++count;
  }
  e->minutes = timeline.take();
  for (Minute& minute : e->minutes) {
    const auto it = squared.find(minute.minute);
    if (it != squared.end()) minute.error_m_rmse = std::sqrt(it->second.first / it->second.second);
  }
}

// Empty when it cannot be used, which is noted.
Picture next_picture(const Sequence& sequence, size_t index, InputReport* report) {
  Picture picture = sequence.gray(index);
  const std::string& name = sequence.images[index].path;
  if (!picture.error.empty()) {
    report->refuse(name, picture.error);
    picture.image = {};
    return picture;
  }
  report->use();
  if (!picture.warning.empty()) report->warn(name, picture.warning);
  return picture;
}

double median_over(const std::vector<Evaluation>& runs, double Evaluation::*member) {
  std::vector<double> values;
  for (const Evaluation& e : runs) values.push_back(e.*member);
  return quantile(std::move(values), 0.5);
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

namespace {

// One run: the core, and what is noted while it is shown the images.
class Run {
 public:
  Run(const Sequence& sequence, const SlamOptions& options, const EvaluationRange& range)
      : sequence_(sequence), range_(range), slam_(begin(), options) {}

  Evaluation finish() {
    const std::vector<PlayedImage> playlist =
        make_playlist(sequence_, range_.play, range_.degradation);
    for (const PlayedImage& played : playlist) {
      show(played);
      if (e_.answers.size() == playlist.size() / 2) {
        e_.keyframes_at_half = slam_.statistics().keyframes;
        e_.points_at_half = slam_.statistics().points;
      }
    }
    if (range_.play.frames < 0) e_.input.end(sequence_.shortfall);  // else it is not what ended it
    if (e_.input.used() == 0) throw UnavailableError(sequence_.name + ": " + e_.input.complaint());
    end();
    return std::move(e_);
  }

 private:
  CameraModel begin() {
    forget_peak_memory();
    e_.sequence = sequence_.name;
    e_.degradation = range_.degradation.name;
    CameraModel camera = degraded_camera(sequence_.camera, range_.degradation);
    camera.fx_px *= range_.focal_factor;
    camera.fy_px *= range_.focal_factor;
    e_.focal_px = camera.fx_px;
    e_.intrinsics_are_guessed = sequence_.intrinsics_are_guessed;
    e_.truth_images = sequence_.images_with_truth();
    for (const std::string& note : sequence_.notes) e_.input.note(note);
    return camera;
  }

  void show(const PlayedImage& played) {
    const Picture original = next_picture(sequence_, played.index, &e_.input);
    if (original.image.bytes.empty()) return;
    const cv::Mat image = degraded_image(view_of(original.image), played, range_.degradation);
    const Time image_time = sequence_.images[played.index].time;
    const double start_ms = thread_cpu_ms();
    const TrackingResult r = slam_.track(
        played.time, {image.data, image.cols, image.rows, static_cast<int>(image.step[0])});
    track_ms_.push_back(thread_cpu_ms() - start_ms);
    e_.answers.push_back({played, image_time, r.state, r.epoch, r.map_from_cam, r.quality, {}});
    if (range_.verbose) print_frame(e_.answers.back(), r, track_ms_.back());
    map();
    const MapDelta delta = slam_.take_delta();
    if (r.is_keyframe) note_keyframe(delta, image_time, &keyframe_times_);
    if (range_.on_delta) range_.on_delta(e_.answers.back(), delta);
    timeline_.note_image(played.time, r.state == TrackingState::kTracking, track_ms_.back(),
                         slam_.statistics());
  }

  void map() {
    while (auto job = slam_.take_job()) {
      const double start_ms = thread_cpu_ms();
      slam_.apply(Slam::run(std::move(*job)));
      job_ms_.push_back(thread_cpu_ms() - start_ms);
      timeline_.note_job(job_ms_.back());
    }
  }

  void end() {
    e_.frames = static_cast<int>(e_.answers.size());
    note_times(track_ms_, job_ms_, &e_);
    e_.peak_mb = peak_memory_mb();
    e_.statistics = slam_.statistics();
    e_.warning = slam_.warning();
    e_.map = slam_.stored_map();
    score(sequence_, &e_);
    note_errors_by_minute(timeline_, &e_);
    if (!range_.save_folder.empty()) {
      try {  // the scores are worth having without the map
        save(slam_, e_, range_.save_folder + "/" + e_.sequence + "_" + e_.degradation);
      } catch (const StartupError& error) {
        e_.not_saved = error.what();
      }
    }
    const MapDelta snapshot = slam_.snapshot();
    e_.hash = hash_of(e_.answers, snapshot);
    if (sequence_.depth_scale <= 0) return;
    e_.depth = check_depth(sequence_, snapshot, keyframe_times_,
                           poses_at_depth_images(sequence_, e_, slam_.epoch()), &e_.depth_input);
    if (!sequence_.depth_camera) compare_transfer(sequence_, live_poses(e_, slam_.epoch()), &e_);
  }

  const Sequence& sequence_;
  const EvaluationRange& range_;
  Evaluation e_;
  Slam slam_;
  Timeline timeline_;
  std::vector<double> track_ms_, job_ms_;
  std::map<KeyframeId, Time> keyframe_times_;
};

}  // namespace

Evaluation evaluate(const Sequence& sequence, const SlamOptions& options,
                    const EvaluationRange& range) {
  return Run(sequence, options, range).finish();
}

std::string complaint(const Evaluation& e) {
  std::string text = e.input.complaint();
  if (e.depth_input.refused() > 0) {
    text += (text.empty() ? "" : "; ") + std::string("depth: ") + e.depth_input.complaint();
  }
  if (!e.not_saved.empty()) text += (text.empty() ? "" : "; ") + e.not_saved;
  return text.empty() ? "" : e.sequence + ": " + text;
}

std::map<Time, Pose<Map, Cam>> poses_at_depth_images(const Sequence& sequence, const Evaluation& e,
                                                     int epoch) {
  const Similarity<World, Map> map_as_world;  // pose_at() speaks of the world
  std::vector<TimedPose> track;
  for (const auto& [time, pose] : live_poses(e, epoch))
    track.push_back({time, map_as_world * pose});
  std::map<Time, Pose<Map, Cam>> poses;
  for (const SequenceImage& depth : sequence.depth_images) {
    const auto pose = pose_at(track, depth.time, milliseconds(100));
    if (pose) poses[depth.time] = map_as_world.inverse() * *pose;
  }
  return poses;
}

Evaluation median_of(const std::vector<Evaluation>& runs) {
  Evaluation e = runs.front();
  for (const Evaluation& run : runs) {
    if (run.hash != e.hash) {
      throw UnavailableError(e.sequence + ": two runs over the same images gave different results");
    }
  }
  for (const auto member :
       {&Evaluation::track_ms_median, &Evaluation::track_ms_p95, &Evaluation::track_ms_max,
        &Evaluation::job_ms_median, &Evaluation::job_ms_max}) {
    e.*member = median_over(runs, member);
  }
  return e;
}

}  // namespace foresight
