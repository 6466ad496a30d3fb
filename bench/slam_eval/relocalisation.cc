#include "bench/slam_eval/relocalisation.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "bench/slam_eval/evaluation.h"
#include "bench/slam_eval/score.h"
#include "common/cpu_time.h"
#include "common/errors.h"
#include "common/pose_alignment.h"

namespace foresight {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr double kDegreesPerMetre = 20 / 0.3;
constexpr double kHintOff_m = 0.03, kHintOff_deg = 2;
constexpr double kNear_m = 0.1, kNear_deg = 7;     // views that are much like a keyframe's
constexpr double kRange_m = 0.3, kRange_deg = 20;  // what is promised

Similarity<World, Map> world_from_map(const StoredMap& map, const Sequence& mapped) {
  std::vector<Pose<World, Cam>> in_world;
  std::vector<Pose<Map, Cam>> in_map;
  for (const StoredMap::Keyframe& k : map.keyframes) {
    const auto truth = mapped.truth_at(k.time);
    if (!truth) continue;
    in_world.push_back(*truth);
    in_map.push_back(k.map_from_cam);
  }
  const auto aligned = align_poses(in_world, in_map);
  if (!aligned) throw UnavailableError(mapped.name + ": its map has no truth to align to");
  return *aligned;
}

double turned_deg(const Pose<World, Cam>& a, const Pose<World, Cam>& b) {
  return a.rotation().angularDistance(b.rotation()) / kDegree;
}

void measure_distance(const StoredMap& map, const Sequence& mapped, const Pose<World, Cam>& truth,
                      RelocalisationTrial* trial) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const StoredMap::Keyframe& k : map.keyframes) {
    const auto view = mapped.truth_at(k.time);
    if (!view) continue;
    const double distance_m = (view->translation() - truth.translation()).norm();
    const double angle_deg = turned_deg(*view, truth);
    if (const double d = std::max(distance_m, angle_deg / kDegreesPerMetre); d < nearest) {
      nearest = d;
      trial->distance_m = distance_m;
      trial->angle_deg = angle_deg;
    }
  }
}

Pose<World, Cam> hinted(const Pose<World, Cam>& truth) {
  const Eigen::Quaterniond turn(
      Eigen::AngleAxisd(kHintOff_deg * kDegree, Eigen::Vector3d(1, 1, 1).normalized()));
  const Eigen::Vector3d shift = kHintOff_m * Eigen::Vector3d(1, -1, 1).normalized();
  return truth * Pose<Cam, Cam>(turn, shift);
}

void finish_jobs(Slam* slam) {
  while (auto job = slam->take_job()) slam->apply(Slam::run(std::move(*job)));
}

struct Group {
  const char* name;
  double within_m, within_deg;
};

std::string describe_group(const Group& group, const std::vector<RelocalisationTrial>& trials) {
  int count = 0, at_once = 0, right = 0, wrong = 0;
  std::vector<double> times;
  for (const RelocalisationTrial& t : trials) {
    count += 1;
    at_once += t.right() && t.images == 1 ? 1 : 0;
    right += t.right() ? 1 : 0;
    wrong += t.wrong() ? 1 : 0;
    times.push_back(t.first_ms);
  }
  if (count == 0) return "";
  char text[240];
  std::snprintf(text, sizeof text,
                "  %-34s %4d views: %5.1f %% placed at once, %5.1f %% in 9 images, %d wrong; first "
                "image %.0f ms median, %.0f max\n",
                group.name, count, 100.0 * at_once / count, 100.0 * right / count, wrong,
                quantile(times, 0.5), quantile(times, 1.0));
  return text;
}

}  // namespace

std::vector<RelocalisationTrial> try_to_relocalise(const StoredMap& map, const Sequence& mapped,
                                                   const Sequence& queries,
                                                   const SlamOptions& options,
                                                   const RelocalisationRange& range) {
  const Similarity<World, Map> aligned = world_from_map(map, mapped);
  Slam slam(map.camera, options);
  slam.restore(map);
  finish_jobs(&slam);
  const cv::Mat black = cv::Mat::zeros(map.camera.height_px, map.camera.width_px, CV_8UC1);
  Time time = queries.images.front().time + seconds(1e6);
  const auto show = [&](const cv::Mat& image) {
    time = time + milliseconds(33);
    return slam.track(time, {image.data, image.cols, image.rows, static_cast<int>(image.step[0])});
  };
  std::vector<RelocalisationTrial> trials;
  for (size_t i = static_cast<size_t>(range.start); i < queries.images.size();
       i += static_cast<size_t>(range.every)) {
    const auto truth = queries.truth_at(queries.images[i].time);
    if (!truth) continue;
    RelocalisationTrial trial;
    trial.path = queries.images[i].path;
    measure_distance(map, mapped, *truth, &trial);
    const Picture picture = queries.gray(i);
    if (!picture.error.empty()) throw UnavailableError(trial.path + ": " + picture.error);
    const cv::Mat image = view_of(picture.image);
    slam.restore(map);
    finish_jobs(&slam);
    (void)show(black);
    if (range.hint) slam.hint(time, aligned.inverse() * hinted(*truth));
    for (int n = 1; n <= range.images; ++n) {
      const double start_ms = thread_cpu_ms();
      const TrackingResult result = show(image);
      if (n == 1) trial.first_ms = thread_cpu_ms() - start_ms;
      if (result.state != TrackingState::kTracking) continue;
      trial.images = n;
      trial.quality = result.quality;
      const Pose<World, Cam> found = aligned * result.map_from_cam;
      trial.error_m = (found.translation() - truth->translation()).norm();
      trial.error_deg = turned_deg(found, *truth);
      break;
    }
    trials.push_back(trial);
  }
  return trials;
}

std::string describe(const std::vector<RelocalisationTrial>& trials) {
  const Group groups[] = {{"within 10 cm and 7 deg", kNear_m, kNear_deg},
                          {"the others within 30 cm and 20 deg", kRange_m, kRange_deg},
                          {"farther", 1e9, 1e9}};
  std::string text;
  std::vector<RelocalisationTrial> left = trials;
  for (const Group& group : groups) {
    const auto others = std::stable_partition(left.begin(), left.end(), [&](const auto& t) {
      return t.distance_m <= group.within_m && t.angle_deg <= group.within_deg;
    });
    text += describe_group(group, {left.begin(), others});
    left.erase(left.begin(), others);
  }
  return text;
}

}  // namespace foresight
