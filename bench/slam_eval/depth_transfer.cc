#include "bench/slam_eval/depth_transfer.h"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "bench/slam_eval/score.h"
#include "procs/slam/geometry.h"
#include "procs/slam/pose_optimizer.h"

namespace foresight {
namespace {

constexpr int kCorners = 400;
constexpr float kThereAndBack_px = 0.5f;
constexpr size_t kMinCorners = 30;

struct Carried {
  Eigen::Vector3d point_in_first;  // m
  Eigen::Vector2d found_in_second;
};

cv::Mat image_at(const Sequence& sequence, Time time) {
  const auto it = std::lower_bound(sequence.images.begin(), sequence.images.end(), time,
                                   [](const SequenceImage& i, Time t) { return i.time < t; });
  if (it == sequence.images.end() || it->time - time > milliseconds(20)) return {};
  const Picture picture = sequence.gray(static_cast<size_t>(it - sequence.images.begin()));
  return picture.error.empty() ? view_of(picture.image).clone() : cv::Mat();
}

// Corners whose depth is known and does not jump nearby, and where they are in the second image.
std::vector<Carried> carry(const Sequence& sequence, const cv::Mat& first, const cv::Mat& depth,
                           const cv::Mat& second) {
  std::vector<cv::Point2f> from, to, back;
  cv::goodFeaturesToTrack(first, from, kCorners, 0.01, 8);
  if (from.empty()) return {};
  std::vector<uchar> ok, back_ok;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(first, second, from, to, ok, error, {15, 15}, 4);
  cv::calcOpticalFlowPyrLK(second, first, to, back, back_ok, error, {15, 15}, 4);
  std::vector<Carried> carried;
  for (size_t i = 0; i < from.size(); ++i) {
    if (!ok[i] || !back_ok[i] || cv::norm(back[i] - from[i]) > kThereAndBack_px) continue;
    const cv::Point at(cvRound(from[i].x), cvRound(from[i].y));
    const cv::Rect around(at.x - 2, at.y - 2, 5, 5);
    if ((around & cv::Rect(0, 0, depth.cols, depth.rows)) != around) continue;
    double low, high;
    cv::minMaxLoc(depth(around), &low, &high);
    if (low <= 0 || high >= 65535 || high > 1.02 * low) continue;
    const double z = sequence.depth_scale * depth.at<uint16_t>(at);
    const Eigen::Vector2d xy = sequence.camera.unproject({from[i].x, from[i].y});
    carried.push_back({z * Eigen::Vector3d(xy.x(), xy.y(), 1), {to[i].x, to[i].y}});
  }
  return carried;
}

double median_error_px(const CameraModel& camera, const Pose<Cam, Cam>& second_from_first,
                       const std::vector<Carried>& carried) {
  std::vector<double> errors;
  for (const Carried& c : carried) {
    const Eigen::Vector3d p = second_from_first * c.point_in_first;
    errors.push_back(p.z() > 0 ? (camera.project(p) - c.found_in_second).norm() : 1e3);
  }
  return quantile(std::move(errors), 0.5);
}

Pose<Cam, Cam> best_fit(const CameraModel& camera, const Pose<Cam, Cam>& second_from_first,
                        const std::vector<Carried>& carried) {
  std::vector<slam::PoseObservation> observations;
  for (const Carried& c : carried) {
    observations.push_back({c.point_in_first, camera.unproject(c.found_in_second), camera.fx_px});
  }
  const Pose<Cam, Cam> start = second_from_first.inverse();
  const Pose<Map, Cam> fit =
      slam::optimize_pose({start.rotation(), start.translation()}, observations).map_from_cam;
  return Pose<Cam, Cam>(fit.rotation(), fit.translation()).inverse();
}

// The scores of one way to know poses, pair by pair.
struct Scores {
  std::vector<double> px, from_fit_m, from_fit_deg;

  void add(const CameraModel& camera, const Pose<Cam, Cam>& second_from_first,
           const Pose<Cam, Cam>& fit, const std::vector<Carried>& carried) {
    const Pose<Cam, Cam> apart = second_from_first.inverse() * fit;
    px.push_back(median_error_px(camera, second_from_first, carried));
    from_fit_m.push_back(apart.translation().norm());
    from_fit_deg.push_back(apart.rotation().angularDistance(Eigen::Quaterniond::Identity()) /
                           slam::kDegree);
  }
  DepthTransfer medians() const {
    if (px.empty()) return {};
    return {static_cast<int>(px.size()), quantile(px, 0.5), quantile(from_fit_m, 0.5),
            quantile(from_fit_deg, 0.5)};
  }
};

}  // namespace

std::vector<DepthTransfer> transfer_through_depth(const Sequence& sequence, Duration apart,
                                                  const std::vector<MetricPoseAt>& poses) {
  std::vector<Scores> scores(poses.size());
  for (const SequenceImage& first : sequence.depth_images) {
    const auto second =
        std::find_if(sequence.images.begin(), sequence.images.end(),
                     [&](const SequenceImage& s) { return s.time - first.time >= apart; });
    if (second == sequence.images.end()) break;
    std::vector<Pose<Cam, Cam>> relative;
    for (const MetricPoseAt& pose_at : poses) {
      const auto a = pose_at(first.time), b = pose_at(second->time);
      if (a && b) relative.push_back(b->inverse() * *a);
    }
    if (relative.size() < poses.size()) continue;
    const cv::Mat first_image = image_at(sequence, first.time);
    const cv::Mat depth = cv::imread(first.path, cv::IMREAD_UNCHANGED);
    const cv::Mat second_image = image_at(sequence, second->time);
    if (first_image.empty() || second_image.empty() || depth.type() != CV_16UC1) continue;
    const std::vector<Carried> carried = carry(sequence, first_image, depth, second_image);
    if (carried.size() < kMinCorners) continue;
    const Pose<Cam, Cam> fit = best_fit(sequence.camera, relative.back(), carried);
    for (size_t i = 0; i < poses.size(); ++i) {
      scores[i].add(sequence.camera, relative[i], fit, carried);
    }
  }
  std::vector<DepthTransfer> results;
  for (const Scores& s : scores) results.push_back(s.medians());
  return results;
}

}  // namespace foresight
