#include "procs/slam/view_candidates.h"

#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/features2d.hpp>
#include <optional>

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

std::vector<KeyframeId> ranked_by_thumbnail(const SlamMap& map, const Thumbnail& thumbnail) {
  std::vector<std::pair<double, KeyframeId>> ranked;
  for (const auto& [id, k] : map.keyframes()) {
    ranked.emplace_back(thumbnail_distance(k.thumbnail, thumbnail), id);
  }
  std::sort(ranked.begin(), ranked.end());
  std::vector<KeyframeId> ids;
  for (const auto& [distance, id] : ranked) ids.push_back(id);
  return ids;
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

struct KeyframeFeatures {
  cv::Mat descriptors;
  std::vector<PointId> point_ids;  // per row
};

// Those features of a keyframe that are where it sees a point.
KeyframeFeatures features_of_points(const SlamMap& map, const Keyframe& keyframe) {
  std::vector<std::pair<Eigen::Vector2d, PointId>> seen;
  for (const PointId id : keyframe.point_ids) {
    seen.emplace_back(map.point(id)->observation_in(keyframe.id)->pixel, id);
  }
  KeyframeFeatures known;
  for (size_t i = 0; i < keyframe.features->pixels.size(); ++i) {
    double nearest_px = kSameFeature_px;
    PointId nearest;
    for (const auto& [pixel, id] : seen) {
      const double apart_px = (pixel - keyframe.features->pixels[i]).norm();
      if (apart_px < nearest_px) {
        nearest_px = apart_px;
        nearest = id;
      }
    }
    if (!nearest.is_valid()) continue;
    known.point_ids.push_back(nearest);
    known.descriptors.push_back(keyframe.features->descriptors.row(static_cast<int>(i)));
  }
  return known;
}

}  // namespace

std::optional<Pose<Map, Cam>> matched_view(const CameraModel& camera, const SlamMap& map,
                                           const Features& image, const Keyframe& keyframe) {
  const KeyframeFeatures known = features_of_points(map, keyframe);
  if (known.point_ids.size() < kMinMatches || image.pixels.size() < 2) return std::nullopt;
  std::vector<std::vector<cv::DMatch>> nearest;
  cv::BFMatcher(cv::NORM_HAMMING).knnMatch(known.descriptors, image.descriptors, nearest, 2);
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> rays;
  for (const std::vector<cv::DMatch>& m : nearest) {
    if (m.size() < 2 || m[0].distance > kDistinct * m[1].distance) continue;
    const Eigen::Vector2d xy = camera.unproject(image.pixels[static_cast<size_t>(m[0].trainIdx)]);
    const Eigen::Vector3d& p =
        map.point(known.point_ids[static_cast<size_t>(m[0].queryIdx)])->position_in_map;
    points.emplace_back(p.x(), p.y(), p.z());
    rays.emplace_back(xy.x(), xy.y());
  }
  if (points.size() < kMinMatches) return std::nullopt;
  cv::Mat turn, shift, matrix;
  if (!solve_pnp(points, rays, kMaxError_px / camera.fx_px, &turn, &shift)) return std::nullopt;
  cv::Rodrigues(turn, matrix);
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
  cv::cv2eigen(matrix, rotation);
  cv::cv2eigen(shift, translation);
  if (!rotation.allFinite() || !translation.allFinite()) return std::nullopt;
  return Pose<Cam, Map>(rotation, translation).inverse();
}

ViewCandidates::ViewCandidates(const CameraModel& camera)
    : camera_(camera), thumbnail_camera_(slam::thumbnail_camera(camera)) {}

std::vector<Pose<Map, Cam>> ViewCandidates::similar_views(const SlamMap& map,
                                                          const Thumbnail& thumbnail) const {
  std::vector<KeyframeId> ids = ranked_by_thumbnail(map, thumbnail);
  if (ids.size() > kSimilarViews) ids.resize(kSimilarViews);
  std::vector<Pose<Map, Cam>> poses;
  for (const KeyframeId id : ids) {
    const Keyframe& k = *map.keyframe(id);
    const ThumbnailAlignment turned =
        align_thumbnails(k.thumbnail, thumbnail, thumbnail_camera_, {}, k.median_depth);
    poses.push_back(k.map_from_cam * turned.source_from_target);
  }
  return poses;
}

std::vector<Pose<Map, Cam>> ViewCandidates::matched_views(const SlamMap& map,
                                                          const PlaceIndex& places,
                                                          const ImagePyramid& pyramid) {
  const std::shared_ptr<const Features> image = detect_features(pyramid);
  const std::vector<PlaceIndex::Ranked> ranked = places.rank(*image);
  std::vector<Pose<Map, Cam>> poses;
  for (size_t i = 0; i < std::min(kMatchedViews, ranked.size()); ++i) {
    const Keyframe& keyframe = *map.keyframe(ranked[next_rank_++ % ranked.size()].keyframe_id);
    if (const auto pose = matched_view(camera_, map, *image, keyframe)) poses.push_back(*pose);
  }
  return poses;
}

}  // namespace foresight::slam
