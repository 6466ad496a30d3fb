#include "bench/slam_eval/depth_check.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

#include "bench/slam_eval/depth_image.h"

namespace foresight {
namespace {

constexpr double kMaxApart_s = 0.5;
constexpr int kPatchRadius_px = 4;

KeyframeId nearest_keyframe(const std::map<KeyframeId, Time>& times, Time time) {
  KeyframeId best;
  double best_s = kMaxApart_s;
  for (const auto& [id, t] : times) {
    const double apart_s = std::abs((t - time).seconds());
    if (apart_s <= best_s) {
      best_s = apart_s;
      best = id;
    }
  }
  return best;
}

// A point and the depths measured around it, as far as its patch reached: a corner on a silhouette
// has the depth of the object in front, but may lie a few pixels outside of it.
struct Compared {
  double depth_mu;
  double sigma_mu;
  std::vector<double> measured_m;
};

std::vector<double> depths_around(const cv::Mat& depth_m, const Eigen::Vector2d& pixel) {
  std::vector<double> depths;
  for (int dv = -kPatchRadius_px; dv <= kPatchRadius_px; ++dv) {
    for (int du = -kPatchRadius_px; du <= kPatchRadius_px; ++du) {
      const int u = static_cast<int>(std::lround(pixel.x())) + du;
      const int v = static_cast<int>(std::lround(pixel.y())) + dv;
      const float measured_m = depth_m.at<float>(v, u);
      if (measured_m > 0) depths.push_back(static_cast<double>(measured_m));
    }
  }
  return depths;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Relative error, the best over the pixels: corners lie on edges.
double relative_error(const Compared& c, double scale) {
  double best = 1e9;
  for (const double d : c.measured_m) {
    const double error = scale * c.depth_mu / d - 1;
    if (std::abs(error) < std::abs(best)) best = error;
  }
  return best;
}

DepthCheck summarise(const std::vector<Compared>& compared) {
  DepthCheck check;
  check.compared = static_cast<int>(compared.size());
  if (compared.empty()) return check;
  std::vector<double> ratios, errors;
  for (const Compared& c : compared) ratios.push_back(median(c.measured_m) / c.depth_mu);
  const double scale = check.metres_per_mu = median(ratios);
  for (const Compared& c : compared) {
    const double error = relative_error(c, scale);
    if (std::abs(error) < 0.05) ++check.within_5_percent;
    if (std::abs(error) < 0.1) ++check.within_10_percent;
    if (error < -0.1) ++check.in_front_10_percent;
    if (std::abs(error) * c.depth_mu < 2 * c.sigma_mu) ++check.within_2_sigma;
    errors.push_back(std::abs(error));
  }
  check.within_5_percent /= static_cast<double>(errors.size());
  check.within_10_percent /= static_cast<double>(errors.size());
  check.in_front_10_percent /= static_cast<double>(errors.size());
  check.within_2_sigma /= static_cast<double>(errors.size());
  check.median_error_percent = 100 * median(errors);
  return check;
}

}  // namespace

DepthCheck check_depth(const Sequence& sequence, const MapDelta& snapshot,
                       const std::map<KeyframeId, Time>& keyframe_times,
                       const std::map<Time, Pose<Map, Cam>>& live_poses, InputReport* report) {
  std::map<PointId, MapPoint> points;
  for (const MapPoint& p : snapshot.points_set) points[p.id] = p;
  std::map<KeyframeId, std::vector<PointId>> seen_by;
  for (const MapObservation& o : snapshot.observations_added) {
    seen_by[o.keyframe_id].push_back(o.point_id);
  }
  std::vector<Compared> compared;
  for (const SequenceImage& entry : sequence.depth_images) {
    const auto live = live_poses.find(entry.time);
    const KeyframeId keyframe = nearest_keyframe(keyframe_times, entry.time);
    if (live == live_poses.end() || !keyframe.is_valid()) continue;
    const cv::Mat depth_m = load_depth(sequence, entry, report);
    if (depth_m.empty()) continue;
    const Pose<Cam, Map> cam_from_map = live->second.inverse();
    for (const PointId id : seen_by[keyframe]) {
      const MapPoint& point = points.at(id);
      const Eigen::Vector3d p = cam_from_map * point.position_in_map.cast<double>();
      if (p.z() <= 0 || !sequence.camera.in_image(sequence.camera.project(p), kPatchRadius_px + 1))
        continue;
      Compared c{p.z(), static_cast<double>(point.sigma_mu),
                 depths_around(depth_m, sequence.camera.project(p))};
      if (!c.measured_m.empty()) compared.push_back(std::move(c));
    }
  }
  return summarise(compared);
}

}  // namespace foresight
