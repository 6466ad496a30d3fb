#include "procs/slam/relocalizer.h"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

namespace foresight::slam {
namespace {

constexpr size_t kSimilarViews = 3;
constexpr size_t kMatchedViews = 2;    // per lost image
constexpr double kSameFeature_px = 4;  // ORB feature and map point
constexpr float kDistinct = 0.8f;      // best distance / second best
constexpr size_t kMinMatches = 12;
constexpr size_t kMinInliers = 10;
constexpr double kMaxError_px = 6;
constexpr int kSeed = 20240817;

std::vector<int32_t> ranked_by_thumbnail(const SlamMap& map, const Thumbnail& thumbnail) {
  std::vector<std::pair<double, int32_t>> ranked;
  for (const auto& [id, k] : map.keyframes()) {
    ranked.emplace_back(thumbnail_distance(k.thumbnail, thumbnail), id);
  }
  std::sort(ranked.begin(), ranked.end());
  std::vector<int32_t> ids;
  for (const auto& [distance, id] : ranked) ids.push_back(id);
  return ids;
}

// The map point that the keyframe observes closest to a pixel, or −1.
int32_t point_at(const SlamMap& map, const Keyframe& keyframe, const cv::Point2f& pixel) {
  int32_t best = -1;
  double best_px = kSameFeature_px;
  for (const int32_t id : keyframe.point_ids) {
    const Observation* o = map.point(id)->observation_in(keyframe.id);
    const double apart_px = (o->pixel - Eigen::Vector2d(pixel.x, pixel.y)).norm();
    if (apart_px < best_px) {
      best_px = apart_px;
      best = id;
    }
  }
  return best;
}

// The library asserts on degenerate sets of points (all in one place, say): no solution, to us.
bool solve_pnp(const std::vector<cv::Point3d>& points, const std::vector<cv::Point2d>& rays,
               double max_error, cv::Mat* turn, cv::Mat* shift) {
  cv::setRNGSeed(kSeed);
  std::vector<int> inliers;
  try {
    return cv::solvePnPRansac(points, rays, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), *turn,
                              *shift, false, 200, static_cast<float>(max_error), 0.99, inliers,
                              cv::SOLVEPNP_SQPNP) &&
           inliers.size() >= kMinInliers;
  } catch (const cv::Exception&) {
    return false;
  }
}

}  // namespace

Relocalizer::Relocalizer(const CameraModel& camera)
    : camera_(camera),
      thumbnail_camera_(slam::thumbnail_camera(camera)),
      orb_(cv::ORB::create(800, 1.3f, 5)) {}

std::vector<Pose<Map, Cam>> Relocalizer::similar_views(const SlamMap& map,
                                                       const Thumbnail& thumbnail) const {
  std::vector<int32_t> ids = ranked_by_thumbnail(map, thumbnail);
  if (ids.size() > kSimilarViews) ids.resize(kSimilarViews);
  std::vector<Pose<Map, Cam>> poses;
  for (const int32_t id : ids) {
    const Keyframe& k = *map.keyframe(id);
    const ThumbnailAlignment turned =
        align_thumbnails(k.thumbnail, thumbnail, thumbnail_camera_, {}, k.median_depth);
    poses.push_back(k.map_from_cam * turned.source_from_target);
  }
  return poses;
}

Relocalizer::Features Relocalizer::detect(const ImagePyramid& pyramid) const {
  Features features;
  orb_->detectAndCompute(pyramid.levels[0], cv::noArray(), features.keypoints,
                         features.descriptors);
  return features;
}

const Relocalizer::KeyframeFeatures& Relocalizer::features_of(const SlamMap& map,
                                                              int32_t keyframe_id) {
  const auto [it, is_new] = cache_.try_emplace(keyframe_id);
  if (!is_new) return it->second;
  const Keyframe& keyframe = *map.keyframe(keyframe_id);
  const Features all = detect(keyframe.pyramid);
  for (size_t i = 0; i < all.keypoints.size(); ++i) {
    const int32_t id = point_at(map, keyframe, all.keypoints[i].pt);
    if (id < 0) continue;
    it->second.point_ids.push_back(id);
    it->second.descriptors.push_back(all.descriptors.row(static_cast<int>(i)));
  }
  return it->second;
}

std::optional<Pose<Map, Cam>> Relocalizer::solve(const SlamMap& map, const Features& seen,
                                                 const KeyframeFeatures& known) const {
  if (known.point_ids.size() < kMinMatches || seen.keypoints.size() < 2) return std::nullopt;
  std::vector<std::vector<cv::DMatch>> nearest;
  cv::BFMatcher(cv::NORM_HAMMING).knnMatch(known.descriptors, seen.descriptors, nearest, 2);
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> rays;
  for (const std::vector<cv::DMatch>& m : nearest) {
    if (m.size() < 2 || m[0].distance > kDistinct * m[1].distance) continue;
    const Point* point = map.point(known.point_ids[static_cast<size_t>(m[0].queryIdx)]);
    if (point == nullptr) continue;
    const cv::Point2f& pixel = seen.keypoints[static_cast<size_t>(m[0].trainIdx)].pt;
    const Eigen::Vector2d xy = camera_.unproject({pixel.x, pixel.y});
    const Eigen::Vector3d& p = point->position_in_map;
    points.emplace_back(p.x(), p.y(), p.z());
    rays.emplace_back(xy.x(), xy.y());
  }
  if (points.size() < kMinMatches) return std::nullopt;
  cv::Mat turn, shift, matrix;
  if (!solve_pnp(points, rays, kMaxError_px / camera_.fx_px, &turn, &shift)) return std::nullopt;
  cv::Rodrigues(turn, matrix);
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
  cv::cv2eigen(matrix, rotation);
  cv::cv2eigen(shift, translation);
  if (!rotation.allFinite() || !translation.allFinite()) return std::nullopt;
  return Pose<Cam, Map>(rotation, translation).inverse();
}

std::vector<Pose<Map, Cam>> Relocalizer::matched_views(const SlamMap& map,
                                                       const ImagePyramid& pyramid,
                                                       const Thumbnail& thumbnail) {
  std::vector<Pose<Map, Cam>> poses;
  const std::vector<int32_t> ids = ranked_by_thumbnail(map, thumbnail);
  const Features seen = detect(pyramid);
  for (size_t i = 0; i < std::min(kMatchedViews, ids.size()); ++i) {
    const int32_t id = ids[next_rank_++ % ids.size()];
    if (const auto pose = solve(map, seen, features_of(map, id))) poses.push_back(*pose);
  }
  return poses;
}

}  // namespace foresight::slam
