#include "procs/slam/point_finder.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "common/check.h"

namespace foresight::slam {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kMaxScaleUp = 3.0;    // of patch area, before a coarser level is taken
constexpr double kMinScaleDown = 0.2;  // of patch area at level 0
constexpr double kMaxStretch = 3.0;    // ratio of the two singular values: slanted views
constexpr double kBorder_px = 5;

std::optional<Vector2d> project(const CameraModel& camera, const Vector3d& p) {
  if (p.z() <= 1e-6) return std::nullopt;
  const Vector2d xy = p.head<2>() / p.z();
  if (xy.norm() > camera.max_radius) return std::nullopt;
  return camera.project_normalized(xy);
}

// A coarser template for a search some levels up: sampled from the source's coarser level too.
struct TemplatePlace {
  int source_level;
  Matrix2d source_from_patch;
};

TemplatePlace coarser(const Corner& corner, const PatchView& view, int extra_levels) {
  const int source_level = std::min(corner.level + extra_levels, kLevels - 1);
  const double factor = level_scale(extra_levels) / level_scale(source_level - corner.level);
  return {source_level, factor * view.source_from_patch};
}

}  // namespace

std::optional<PatchView> view_corner(const CameraModel& camera, const Corner& corner, double depth,
                                     const Pose<Cam, Cam>& view_from_source) {
  const Vector3d p = view_from_source * (depth * corner.ray);
  const auto center = project(camera, p);
  if (!center || !camera.in_image(*center, kBorder_px)) return std::nullopt;
  const auto right = project(camera, view_from_source * (depth * corner.ray_right));
  const auto down = project(camera, view_from_source * (depth * corner.ray_down));
  if (!right || !down) return std::nullopt;
  Matrix2d warp;  // px of the full view per px of the source level
  warp << *right - *center, *down - *center;
  double area = warp.determinant();
  if (!(area > kMinScaleDown)) return std::nullopt;        // mirrored: seen from behind
  const double stretch = warp.squaredNorm() / (2 * area);  // (σ₁² + σ₂²) / 2σ₁σ₂
  if (stretch > 0.5 * (kMaxStretch + 1 / kMaxStretch)) return std::nullopt;
  PatchView view;
  view.pixel = *center;
  view.depth = p.z();
  while (area > kMaxScaleUp) {
    if (++view.level == kLevels) return std::nullopt;
    area /= 4;
  }
  view.source_from_patch = (warp / level_scale(view.level)).inverse();
  return view;
}

PointFinder::PointFinder(const CameraModel& camera, const SlamMap& map, const ImagePyramid& pyramid,
                         const Pose<Map, Cam>& map_from_cam)
    : camera_(camera),
      map_(map),
      pyramid_(pyramid),
      map_from_cam_(map_from_cam),
      cam_from_map_(map_from_cam.inverse()) {}

const Pose<Cam, Cam>& PointFinder::view_from_keyframe(KeyframeId keyframe_id) const {
  const auto [it, is_new] = view_from_keyframe_.try_emplace(keyframe_id);
  if (is_new) it->second = cam_from_map_ * map_.keyframe(keyframe_id)->map_from_cam;
  return it->second;
}

std::optional<PatchView> PointFinder::predict(const Point& point) const {
  const Vector3d p = cam_from_map_ * point.position_in_map;
  const auto pixel = project(camera_, p);
  if (!pixel || !camera_.in_image(*pixel, kBorder_px)) return std::nullopt;
  const Pose<Cam, Cam>& view_from_source = view_from_keyframe(point.source.keyframe_id);
  const double depth =
      (view_from_source.rotation().conjugate() * (p - view_from_source.translation())).z();
  auto view = view_corner(camera_, point.source, depth, view_from_source);
  if (view) view->pixel = *pixel;  // adjusted position, not the corner's own ray
  return view;
}

std::optional<PointMatch> PointFinder::find(const Point& point, const PatchView& view,
                                            const PointSearch& search) const {
  const Corner& corner = point.source;
  const int level = view.level + search.extra_levels;
  if (level >= kLevels) return std::nullopt;
  const TemplatePlace place = coarser(corner, view, search.extra_levels);
  const Keyframe* source = map_.keyframe(corner.keyframe_id);
  FORESIGHT_CHECK(source != nullptr);
  Patch patch;
  if (!warp_patch(source->pyramid.levels[static_cast<size_t>(place.source_level)],
                  level_from_image(corner.pixel, place.source_level), place.source_from_patch,
                  &patch)) {
    return std::nullopt;
  }
  const cv::Mat& image = pyramid_.levels[static_cast<size_t>(level)];
  const Vector2d predicted = level_from_image(view.pixel, level);
  const PatchMatch coarse = search_patch(image, patch, predicted, predicted, search.radius_px);
  if (coarse.zncc < search.min_zncc - 0.1) return std::nullopt;
  const auto fine = align_patch(image, patch, coarse.center);
  if (!fine || fine->zncc < search.min_zncc) return std::nullopt;
  PointMatch match;
  match.point_id = point.id;
  match.observation.level = level;
  match.observation.pixel = image_from_level(fine->center, level);
  match.observation.xy = camera_.unproject(match.observation.pixel);
  match.observation.px_per_xy = camera_.px_per_xy(match.observation.xy);
  return match;
}

}  // namespace foresight::slam
