#include "bench/evaluate/homography_baseline.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <random>

#include "bench/evaluate/image_scores.h"

namespace foresight {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// n·x = 1 for points x of the plane (in the delayed camera); n = 0 is the plane at infinity.
using InversePlane = Vector3d;

Matrix3d camera_matrix(const CameraModel& c) {
  Matrix3d k;
  k << c.fx_px, 0, c.cx_px, 0, c.fy_px, c.cy_px, 0, 0, 1;
  return k;
}

std::vector<Vector3d> visible_points(const CameraModel& camera, const Pose<Cam, Map>& cam_from_map,
                                     const std::vector<Vector3d>& points_in_map) {
  std::vector<Vector3d> visible;
  for (const Vector3d& p : points_in_map) {
    const Vector3d in_cam = cam_from_map * p;
    if (in_cam.z() > 1e-6 && camera.in_image(camera.project(in_cam))) visible.push_back(in_cam);
  }
  return visible;
}

// Most points within 3 % of their depth, by seeded sampling.
std::optional<InversePlane> fit_plane(const std::vector<Vector3d>& points) {
  if (points.size() < 10) return std::nullopt;
  std::mt19937 random(7);
  std::optional<InversePlane> best;
  size_t best_count = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Matrix3d rows;
    for (int i = 0; i < 3; ++i) rows.row(i) = points[random() % points.size()].transpose();
    if (std::abs(rows.determinant()) < 1e-9) continue;
    const InversePlane n = rows.inverse() * Vector3d::Ones();
    const auto count =
        static_cast<size_t>(std::count_if(points.begin(), points.end(), [&](const Vector3d& p) {
          return std::abs(n.dot(p) - 1) < 0.03;
        }));
    if (count > best_count) {
      best_count = count;
      best = n;
    }
  }
  return best;
}

std::vector<InversePlane> candidate_planes(const std::vector<Vector3d>& visible) {
  std::vector<InversePlane> planes{Vector3d::Zero()};
  if (visible.empty()) return planes;
  std::vector<double> depths;
  for (const Vector3d& p : visible) depths.push_back(p.z());
  planes.push_back({0, 0, 1 / percentile(depths, 0.5)});
  if (const auto fitted = fit_plane(visible)) planes.push_back(*fitted);
  return planes;
}

}  // namespace

MaskedPicture warp_by_best_plane(const CameraModel& camera, const MaskedPicture& delayed,
                                 const Pose<Map, Cam>& map_from_delayed_cam,
                                 const Pose<Map, Cam>& map_from_cam,
                                 const std::vector<Vector3d>& points_in_map,
                                 const MaskedPicture& truth) {
  const Matrix3d k = camera_matrix(camera);
  const Pose<Cam, Cam> now_from_delayed = map_from_cam.inverse() * map_from_delayed_cam;
  const auto visible = visible_points(camera, map_from_delayed_cam.inverse(), points_in_map);
  // Pixels beside the rim would be mixed with its black.
  cv::Mat mixable;
  cv::erode(delayed.mask, mixable, cv::Mat::ones(3, 3, CV_8U));
  MaskedPicture best;
  double best_psnr = -1;
  for (const InversePlane& n : candidate_planes(visible)) {
    const Matrix3d h = k *
                       (now_from_delayed.rotation().toRotationMatrix() +
                        now_from_delayed.translation() * n.transpose()) *
                       k.inverse();
    cv::Mat homography(3, 3, CV_64F);
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) homography.at<double>(r, c) = h(r, c);
    }
    MaskedPicture candidate;
    cv::warpPerspective(delayed.rgb, candidate.rgb, homography, mixable.size());
    cv::warpPerspective(mixable, candidate.mask, homography, mixable.size(), cv::INTER_NEAREST);
    const double score = psnr_db(candidate.rgb, truth.rgb, candidate.mask & truth.mask).value_or(0);
    if (score > best_psnr) {
      best_psnr = score;
      best = candidate;
    }
  }
  return best;
}

}  // namespace foresight
