#include "procs/slam/depth_seeds.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "procs/slam/geometry.h"
#include "procs/slam/patch.h"
#include "procs/slam/point_finder.h"

namespace foresight::slam {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kNearest = 0.25, kFarthest = 40;  // of the likely depth: the first range
constexpr double kLineMargin_px = 2.0;             // at the level: pose errors, rolling shutter
constexpr double kMaxSegment_px = 120;             // at the level
constexpr double kMinBaselineStep = 0.006;         // between sightings, in depths: about 3 px
constexpr size_t kMaxSightings = 8;
constexpr size_t kMinSightings = 3;
// A young point may be far from certain in depth: it already tells how the camera turns, and bundle
// adjustment improves it. Receivers hear of it when it stands (Mapper::review_points).
constexpr double kMaxRelativeSigma = 0.4;
constexpr double kMinParallaxDeg = 0.3;

constexpr double kUnique = 0.93;  // second best correlation / best
constexpr int kMaxMisses = 12;

Vector3d center_in_source(const Pose<Cam, Cam>& view_from_source) {
  return view_from_source.inverse().translation();
}

double sighting_error_px(const Seed& seed, const SeedSighting& s, double inverse_depth) {
  const Vector3d p = s.view_from_source.rotation() * seed.corner.ray +
                     inverse_depth * s.view_from_source.translation();
  if (p.z() <= 1e-6) return 1e6;
  return s.scale_px * (p.head<2>() / p.z() - s.xy).norm();
}

// Gauss–Newton over one unknown with Huber weights. Returns the information, 1/σ² in px⁻².
double fit_inverse_depth(const Seed& seed, double* inverse_depth) {
  double information = 0;
  for (int iteration = 0; iteration < 6; ++iteration) {
    double gradient = 0;
    information = 0;
    for (const SeedSighting& s : seed.sightings) {
      const Vector3d& t = s.view_from_source.translation();
      const Vector3d p = s.view_from_source.rotation() * seed.corner.ray + *inverse_depth * t;
      if (p.z() <= 1e-6) continue;
      const Vector2d projected = p.head<2>() / p.z();
      const Vector2d residual = s.scale_px * (projected - s.xy);
      const Vector2d jacobian = s.scale_px * (t.head<2>() - projected * t.z()) / p.z();
      const double error = residual.norm(), weight = error < 1.0 ? 1.0 : 1.0 / error;
      information += weight * jacobian.squaredNorm();
      gradient += weight * jacobian.dot(residual);
    }
    if (information < 1e-12) return 0;
    const double step = gradient / information;
    *inverse_depth -= step;
    if (std::abs(step) < 1e-6 * std::abs(*inverse_depth)) break;
  }
  return information;
}

}  // namespace

bool fit_seed(Seed* seed) {
  for (int attempt = 0; attempt < 3; ++attempt) {
    double inverse_depth = seed->inverse_depth;
    const double information = fit_inverse_depth(*seed, &inverse_depth);
    if (information <= 0 || !std::isfinite(inverse_depth)) return false;
    size_t worst = 0;
    seed->worst_error_px = 0;
    for (size_t i = 0; i < seed->sightings.size(); ++i) {
      const double error = sighting_error_px(*seed, seed->sightings[i], inverse_depth);
      if (error > seed->worst_error_px) {
        seed->worst_error_px = error;
        worst = i;
      }
    }
    const double sigma = 1 / std::sqrt(information);  // of one pixel of noise
    if (seed->worst_error_px > 2.0 && seed->sightings.size() > 2) {
      seed->sightings.erase(seed->sightings.begin() + static_cast<std::ptrdiff_t>(worst));
      continue;
    }
    if (seed->worst_error_px > 2.0 || inverse_depth < -3 * sigma) return false;
    seed->inverse_depth = std::max(inverse_depth, 1e-4);
    seed->relative_sigma = sigma / seed->inverse_depth;
    seed->low = std::max(inverse_depth - 3 * sigma, 1e-5);
    seed->high = std::max(inverse_depth + 3 * sigma, 2e-5);
    seed->parallax_deg = 0;
    for (const SeedSighting& s : seed->sightings) {
      const Vector3d point = seed->corner.ray / seed->inverse_depth;
      const double angle =
          angle_between(point, point - center_in_source(s.view_from_source)) / kDegree;
      seed->parallax_deg = std::max(seed->parallax_deg, angle);
    }
    return true;
  }
  return false;
}

DepthSeeds::DepthSeeds(const CameraModel& camera, const SlamOptions& options)
    : camera_(camera), options_(options) {}

namespace {

Seed new_seed(const Corner& corner, double likely_depth) {
  Seed seed;
  seed.corner = corner;
  seed.inverse_depth = 1 / likely_depth;
  seed.low = 1 / (kFarthest * likely_depth);
  seed.high = 1 / (kNearest * likely_depth);
  return seed;
}

enum class Sight { kSkipped, kMissed, kSeen };

// Looks for a seed in one image.
Sight search_one(const CameraModel& camera, double min_zncc, const ImagePyramid& source,
                 const ImagePyramid& pyramid, const Pose<Cam, Cam>& view_from_source, Seed* seed) {
  const Vector3d center = center_in_source(view_from_source);
  double nearest_sighting = center.norm();
  for (const SeedSighting& s : seed->sightings) {
    nearest_sighting =
        std::min(nearest_sighting, (center - center_in_source(s.view_from_source)).norm());
  }
  if (nearest_sighting * seed->inverse_depth < kMinBaselineStep) return Sight::kSkipped;
  const Corner& corner = seed->corner;
  const auto view = view_corner(camera, corner, 1 / seed->inverse_depth, view_from_source);
  if (!view) return Sight::kSkipped;
  const auto place = [&](double inverse_depth) -> Vector2d {
    const Vector3d p =
        view_from_source.rotation() * corner.ray + inverse_depth * view_from_source.translation();
    const bool usable = p.z() > 0.05 && (p.head<2>() / p.z()).norm() < camera.max_radius;
    return level_from_image(usable ? camera.project(p) : view->pixel, view->level);
  };
  const Vector2d a = place(seed->low), b = place(seed->high);
  if ((a - b).norm() > kMaxSegment_px) return Sight::kSkipped;
  Patch patch;
  if (!warp_patch(source.levels[static_cast<size_t>(corner.level)],
                  level_from_image(corner.pixel, corner.level), view->source_from_patch, &patch)) {
    return Sight::kSkipped;
  }
  const cv::Mat& image = pyramid.levels[static_cast<size_t>(view->level)];
  const PatchMatch coarse = search_patch(image, patch, a, b, kLineMargin_px, Ambiguity::kMeasure);
  if (coarse.zncc < min_zncc) return Sight::kMissed;
  if (coarse.second_zncc > kUnique * coarse.zncc) return Sight::kMissed;
  const auto fine = align_patch(image, patch, coarse.center);
  if (!fine || fine->zncc < min_zncc + 0.05) return Sight::kMissed;
  const Vector2d xy = camera.unproject(image_from_level(fine->center, view->level));
  if (seed->sightings.size() == kMaxSightings) seed->sightings.erase(seed->sightings.begin() + 1);
  seed->sightings.push_back(
      {view_from_source, xy, camera.px_per_xy(xy) / level_scale(view->level)});
  return Sight::kSeen;
}

}  // namespace

std::vector<Seed> find_seeds(const CameraModel& camera, const SlamOptions& options,
                             SeedSearch search) {
  std::vector<Seed> seeds;
  const ImagePyramid& source = search.keyframe.pyramid;
  for (const DetectedCorner& c :
       detect_corners(source, options.seeds_per_keyframe, &search.occupied)) {
    if (const auto corner = make_corner(camera, search.keyframe_id, c)) {
      seeds.push_back(new_seed(*corner, search.median_depth));
    }
  }
  for (const SeedSearch::View& other : search.others) {
    const Pose<Cam, Cam> view_from_source =
        other.map_from_cam.inverse() * search.keyframe.map_from_cam;
    for (Seed& seed : seeds) {
      const Sight sight =
          search_one(camera, options.min_zncc, source, other.pyramid, view_from_source, &seed);
      if (sight == Sight::kSeen && !fit_seed(&seed)) seed.misses += 4;
    }
  }
  return seeds;
}

void DepthSeeds::add(std::vector<Seed> seeds) {
  for (Seed& seed : seeds) seeds_.push_back(std::move(seed));
}

void DepthSeeds::search(const SlamMap& map, const ImagePyramid& pyramid,
                        const Pose<Map, Cam>& map_from_cam, int max_searches) {
  const Pose<Cam, Map> cam_from_map = map_from_cam.inverse();
  int searches = 0;
  for (size_t visited = 0; visited < seeds_.size() && searches < max_searches; ++visited) {
    next_ = next_ + 1 < seeds_.size() ? next_ + 1 : 0;
    Seed& seed = seeds_[next_];
    const Keyframe& source = *map.keyframe(seed.corner.keyframe_id);
    const Sight sight = search_one(camera_, options_.min_zncc, source.pyramid, pyramid,
                                   cam_from_map * source.map_from_cam, &seed);
    if (sight == Sight::kSkipped) continue;
    ++searches;
    const bool good = sight == Sight::kSeen && fit_seed(&seed);
    seed.misses = good ? 0 : seed.misses + (sight == Sight::kSeen ? 4 : 1);
  }
}

std::vector<Seed> DepthSeeds::take_mature() {
  std::vector<Seed> mature, waiting;
  for (Seed& seed : seeds_) {
    const bool is_mature = seed.sightings.size() >= kMinSightings &&
                           seed.parallax_deg >= kMinParallaxDeg &&
                           seed.worst_error_px <= options_.point_max_error_px &&
                           seed.relative_sigma <= kMaxRelativeSigma;
    (is_mature ? mature : waiting).push_back(std::move(seed));
  }
  seeds_ = std::move(waiting);
  return mature;
}

void DepthSeeds::scale_keyframe(KeyframeId id, double factor) {
  for (Seed& seed : seeds_) {
    if (seed.corner.keyframe_id != id) continue;
    seed.inverse_depth /= factor;
    seed.low /= factor;
    seed.high /= factor;
    for (SeedSighting& s : seed.sightings) {
      s.view_from_source = {s.view_from_source.rotation(),
                            factor * s.view_from_source.translation()};
    }
  }
}

void DepthSeeds::forget_keyframe(KeyframeId id) {
  std::erase_if(seeds_, [&](const Seed& s) { return s.corner.keyframe_id == id; });
}

void DepthSeeds::prune(KeyframeId newest_keyframe_id, int kept_keyframes) {
  const KeyframeId oldest(newest_keyframe_id.value() - kept_keyframes);
  std::erase_if(seeds_, [&](const Seed& s) {
    return s.misses >= kMaxMisses || s.corner.keyframe_id < oldest;
  });
}

}  // namespace foresight::slam
