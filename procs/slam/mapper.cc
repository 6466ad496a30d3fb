#include "procs/slam/mapper.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "common/check.h"
#include "procs/slam/geometry.h"
#include "procs/slam/keyframe_culling.h"
#include "procs/slam/view_coverage.h"

namespace foresight::slam {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kSeedKeyframes = 6;     // newest ones whose seeds are alive
constexpr int kVerifyKeyframes = 10;  // looked at for a new point
constexpr double kDuplicate_px = 5;
constexpr double kSamePlace_px = 2;  // of a corner followed and its patch found
constexpr double kOccupied_px = 9;
constexpr int kSimilarViewDeg = 40;
constexpr int kSeedViews = 3;         // keyframes in which new seeds are searched at once
constexpr int kReviewImages = 30;     // at least so often points are reviewed
constexpr int kManyPredictions = 30;  // after so many a point has shown what it is worth
constexpr double kHardlyFound = 0.5;
constexpr int kCulledAtOnce = 2;
constexpr int kForgottenAtOnce = 4;  // when memory is short
// A view that is covered becomes no keyframe. Less than makes one superfluous: else the next one
// would take its place, and so on for ever.
constexpr double kCovered = 0.7;
constexpr int kAlikeKeyframes = 10;    // one of which then sees what a covered view sees
constexpr size_t kYoungKeyframes = 8;  // up to so many the map counts as young
constexpr double kYoungGrowth = 0.7;   // of its longest baseline, to the next keyframe

bool is_covered(const SlamMap& map, const TrackingAttempt& tracking) {
  if (map.keyframes().size() < kThriftyKeyframes) return false;
  std::vector<const Point*> found;
  for (const PointMatch& m : tracking.inliers) found.push_back(map.point(m.point_id));
  return ViewCoverage(map).share(found, tracking.map_from_cam.translation()) >= kCovered;
}

double median_depth(const SlamMap& map, const Pose<Map, Cam>& map_from_cam,
                    const std::vector<PointMatch>& matches, double fallback) {
  const Pose<Cam, Map> cam_from_map = map_from_cam.inverse();
  std::vector<double> depths;
  for (const PointMatch& m : matches) {
    const double z = (cam_from_map * map.point(m.point_id)->position_in_map).z();
    if (z > 0) depths.push_back(z);
  }
  return median(std::move(depths), fallback);
}

// Largest angle between the first observer's ray and another's.
double parallax_deg(const SlamMap& map, const Point& point) {
  const auto ray_from = [&](const Observation& o) -> Vector3d {
    return point.position_in_map - map.keyframe(o.keyframe_id)->map_from_cam.translation();
  };
  const Vector3d first = ray_from(point.observations.front());
  double largest = 0;
  for (const Observation& o : point.observations) {
    largest = std::max(largest, angle_between(first, ray_from(o)));
  }
  return largest / kDegree;
}

double distance_in_depths(const SlamMap& map, const Pose<Map, Cam>& map_from_cam, double depth) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& [id, k] : map.keyframes()) {
    const double turned = k.map_from_cam.rotation().angularDistance(map_from_cam.rotation());
    if (turned > kSimilarViewDeg * kDegree) continue;
    nearest = std::min(nearest,
                       (k.map_from_cam.translation() - map_from_cam.translation()).norm() / depth);
  }
  return nearest;
}

}  // namespace

Mapper::Mapper(const CameraModel& camera, const SlamOptions& options)
    : camera_(camera), options_(options), seeds_(camera, options) {}

void Mapper::begin(const InitialMap& initial, SlamMap* map) {
  FORESIGHT_CHECK(map->empty());
  seeds_.clear();
  const auto add = [&](const InitialMap::View& view) {
    Keyframe keyframe;
    keyframe.time = view.time;
    keyframe.map_from_cam = view.map_from_cam;
    keyframe.pyramid = view.pyramid;
    keyframe.thumbnail = make_thumbnail(view.pyramid);
    return map->add_keyframe(std::move(keyframe));
  };
  const KeyframeId first = add(initial.first);
  const KeyframeId second = add(initial.second);
  for (const InitialMap::PointInit& p : initial.points) {
    const auto corner = make_corner(camera_, first, p.corner);
    if (!corner) continue;
    const PointId id = map->add_point(p.position_in_map, *corner);
    map->add_observation(id, second_observation(*map, id, p.second_pixel));
  }
  unseeded_ = {first, second};
}

// Where the second keyframe sees a point of the first map: its patch is found there as in any image
// to come, so that observations agree; the followed corner's place, which drifts a little, if not.
Observation Mapper::second_observation(const SlamMap& map, PointId point_id,
                                       const Vector2d& followed_px) const {
  const Keyframe& second = map.newest_keyframe();
  const PointFinder finder(camera_, map, second.pyramid, second.map_from_cam);
  const Point& point = *map.point(point_id);
  if (const auto view = finder.predict(point)) {
    PointSearch search;
    search.min_zncc = options_.min_zncc;
    if (const auto match = finder.find(point, *view, search)) {
      Observation observation = match->observation;
      observation.keyframe_id = second.id;
      if ((observation.pixel - followed_px).norm() < kSamePlace_px) return observation;
    }
  }
  const Vector2d xy = camera_.unproject(followed_px);
  return {second.id, 0, followed_px, xy, camera_.px_per_xy(xy)};
}

bool Mapper::wants_keyframe(const SlamMap& map, Time time, const TrackingAttempt& tracking) const {
  const double interval_s = (time - map.newest_keyframe().time).seconds();
  if (std::abs(interval_s) < options_.keyframe_min_interval_s) return false;
  if (tracking.quality < 0.4) return false;  // do not build on a doubtful pose
  std::set<PointId> found;
  for (const PointMatch& m : tracking.inliers) found.insert(m.point_id);
  const std::map<KeyframeId, int> shared = shared_point_counts(map, found);
  if (shared.empty()) return false;
  const std::vector<KeyframeId> alike = first_few(by_count(shared), kAlikeKeyframes);
  const Keyframe& reference = *map.keyframe(alike.front());
  const double depth =
      median_depth(map, tracking.map_from_cam, tracking.inliers, reference.median_depth);
  const PointFinder finder(camera_, map, reference.pyramid, tracking.map_from_cam);
  const bool is_far =
      distance_in_depths(map, tracking.map_from_cam, depth) > wanted_baseline(map, depth);
  if (!is_far && overlaps(map, finder, reference)) return false;
  if (!is_covered(map, tracking)) return true;
  return std::none_of(alike.begin(), alike.end(),
                      [&](KeyframeId id) { return overlaps(map, finder, *map.keyframe(id)); });
}

// Whether most of a keyframe's points are in view.
bool Mapper::overlaps(const SlamMap& map, const PointFinder& finder,
                      const Keyframe& keyframe) const {
  int visible = 0;
  for (const PointId id : keyframe.point_ids) {
    if (finder.predict(*map.point(id))) ++visible;
  }
  return visible >= options_.keyframe_min_overlap * static_cast<double>(keyframe.point_ids.size());
}

// A young map rests on a short baseline: it gets keyframes at shorter distances until it stands.
double Mapper::wanted_baseline(const SlamMap& map, double depth) const {
  if (map.keyframes().size() > kYoungKeyframes) return options_.keyframe_baseline;
  const Eigen::Vector3d first = map.keyframes().begin()->second.map_from_cam.translation();
  double longest = 0;
  for (const auto& [id, k] : map.keyframes()) {
    longest = std::max(longest, (k.map_from_cam.translation() - first).norm());
  }
  return std::min(options_.keyframe_baseline, kYoungGrowth * longest / depth);
}

KeyframeId Mapper::insert_keyframe(const Frame& frame, const TrackingAttempt& tracking,
                                   SlamMap* map) {
  Keyframe keyframe;
  keyframe.time = frame.time;
  keyframe.map_from_cam = tracking.map_from_cam;
  keyframe.pyramid = frame.pyramid;
  keyframe.thumbnail = frame.thumbnail;
  keyframe.median_depth = median_depth(*map, tracking.map_from_cam, tracking.inliers,
                                       map->newest_keyframe().median_depth);
  std::vector<PointMatch> matches = tracking.inliers;
  for (const PointMatch& m : find_remaining_points(
           camera_, *map, frame.pyramid, tracking.map_from_cam, tracking.searched, options_)) {
    matches.push_back(m);
  }
  const KeyframeId id = map->add_keyframe(std::move(keyframe));
  for (PointMatch& m : matches) {
    m.observation.keyframe_id = id;
    map->add_observation(m.point_id, m.observation);
  }
  review_points(map);
  cull_keyframes(map);
  seeds_.prune(id, kSeedKeyframes);
  unseeded_.push_back(id);
  return id;
}

void Mapper::grow(const Frame& frame, const Pose<Map, Cam>& map_from_cam, SlamMap* map) {
  seeds_.search(*map, frame.pyramid, map_from_cam, options_.max_seed_searches);
  make_points(map);
  seeds_.prune(map->newest_keyframe().id, kSeedKeyframes);
}

std::optional<SeedSearch> Mapper::take_seed_search(const SlamMap& map) {
  while (!unseeded_.empty()) {
    const KeyframeId id = unseeded_.front();
    unseeded_.pop_front();
    if (map.keyframe(id) != nullptr) return seed_search(id, map);
  }
  return std::nullopt;
}

SeedSearch Mapper::seed_search(KeyframeId keyframe_id, const SlamMap& map) const {
  const Keyframe& keyframe = *map.keyframe(keyframe_id);
  OccupancyMask mask(camera_.width_px, camera_.height_px);
  const PointFinder finder(camera_, map, keyframe.pyramid, keyframe.map_from_cam);
  for (const PointId id : keyframe.point_ids) {
    const Point& point = *map.point(id);
    if (const auto view = finder.predict(point)) mask.add(view->pixel, kOccupied_px);
  }
  for (const Seed& seed : seeds_.seeds()) {
    const auto view = view_corner(camera_, seed.corner, 1 / seed.inverse_depth,
                                  finder.view_from_keyframe(seed.corner.keyframe_id));
    if (view && seed.sightings.size() > 1) mask.add(view->pixel, kOccupied_px);
  }
  SeedSearch search{keyframe_id,
                    {keyframe.pyramid, keyframe.map_from_cam},
                    keyframe.median_depth,
                    std::move(mask),
                    {}};
  std::map<KeyframeId, int> shared = shared_point_counts(map, keyframe.point_ids);
  shared.erase(keyframe_id);
  for (const KeyframeId id : first_few(by_count(shared), kSeedViews)) {
    search.others.push_back({map.keyframe(id)->pyramid, map.keyframe(id)->map_from_cam});
  }
  return search;
}

void Mapper::add_seeds(KeyframeId keyframe_id, std::vector<Seed> seeds, SlamMap* map) {
  if (map->keyframe(keyframe_id) == nullptr) return;  // culled meanwhile
  seeds_.add(std::move(seeds));
  make_points(map);
}

void Mapper::make_points(SlamMap* map) {
  std::map<KeyframeId, SourceView> sources;
  for (const Seed& seed : seeds_.take_mature()) {
    const KeyframeId id = seed.corner.keyframe_id;
    auto it = sources.find(id);
    if (it == sources.end()) it = sources.emplace(id, source_view(*map, id)).first;
    make_point(seed, &it->second, map);
  }
}

// What new points of one keyframe need to know of it.
Mapper::SourceView Mapper::source_view(const SlamMap& map, KeyframeId keyframe_id) const {
  SourceView view{{}, OccupancyMask(camera_.width_px, camera_.height_px)};
  const Keyframe& source = *map.keyframe(keyframe_id);
  for (const PointId id : source.point_ids) {
    view.occupied.add(map.point(id)->observation_in(keyframe_id)->pixel, kDuplicate_px);
  }
  std::map<KeyframeId, int> shared = shared_point_counts(map, source.point_ids);
  shared.erase(keyframe_id);
  for (const KeyframeId id : first_few(by_count(shared), kVerifyKeyframes)) {
    const Keyframe& other = *map.keyframe(id);
    view.neighbours.emplace_back(id, PointFinder(camera_, map, other.pyramid, other.map_from_cam));
  }
  return view;
}

void Mapper::make_point(const Seed& seed, SourceView* view, SlamMap* map) {
  if (view->occupied.contains(seed.corner.pixel)) return;
  view->occupied.add(seed.corner.pixel, kDuplicate_px);
  const Keyframe& source = *map->keyframe(seed.corner.keyframe_id);
  const Vector3d position = source.map_from_cam * (seed.corner.ray / seed.inverse_depth);
  const PointId point_id = map->add_point(position, seed.corner);
  PointSearch search;
  search.min_zncc = options_.min_zncc;
  for (const auto& [id, finder] : view->neighbours) {
    const Point& point = *map->point(point_id);
    const auto predicted = finder.predict(point);
    if (!predicted) continue;
    const auto match = finder.find(point, *predicted, search);
    if (!match) continue;
    Observation observation = match->observation;
    const double error_px =
        (observation.pixel - predicted->pixel).norm() / level_scale(observation.level);
    if (error_px > options_.max_reprojection_error_px) continue;
    observation.keyframe_id = id;
    map->add_observation(point_id, observation);
  }
}

void Mapper::review_if_due(SlamMap* map) {
  if (++images_since_review_ >= kReviewImages) review_points(map);
}

// Probation: a point is confirmed when enough keyframes see it, and goes when it proves bad.
void Mapper::review_points(SlamMap* map) {
  const KeyframeId newest = map->newest_keyframe().id;
  images_since_review_ = 0;
  std::vector<PointId> bad, good;
  for (const auto& [id, p] : map->points()) {
    const auto seen = static_cast<int>(p.observations.size());
    const bool rarely_found = p.predicted_count >= 12 &&
                              p.found_count < options_.point_min_found_ratio * p.predicted_count;
    const bool hardly_known = p.predicted_count >= kManyPredictions &&
                              seen <= options_.point_confirm_keyframes &&
                              p.found_count < kHardlyFound * p.predicted_count;
    const int age = newest.value() - p.born_keyframe_id.value();
    const bool unconfirmed =
        !p.confirmed &&
        ((age >= 2 && seen < 2) || (age >= 4 && seen < options_.point_confirm_keyframes));
    if (seen == 0 || (!p.confirmed && rarely_found) || hardly_known || unconfirmed) {
      bad.push_back(id);
    } else if (!p.confirmed && seen >= options_.point_confirm_keyframes &&
               parallax_deg(*map, p) >= options_.point_min_parallax_deg) {
      good.push_back(id);
    }
  }
  for (const PointId id : bad) map->remove_point(id);
  for (const PointId id : good) map->confirm_point(id);
}

void Mapper::cull_keyframes(SlamMap* map) {
  for (int culled = 0; culled < kCulledAtOnce; ++culled) {
    const std::optional<KeyframeId> id = superfluous_keyframe(*map, options_);
    if (!id) break;
    remove_keyframe(*id, map);
  }
  const double limit_bytes = 1e6 * options_.memory_limit_mb;
  for (int forgotten = 0; forgotten < kForgottenAtOnce; ++forgotten) {
    if (limit_bytes <= 0 || static_cast<double>(map->memory_bytes()) <= limit_bytes) return;
    const std::optional<KeyframeId> id = least_needed_keyframe(*map);
    if (!id) return;
    remove_keyframe(*id, map);
    ++forgotten_keyframes_;
  }
}

// Points whose patch comes from it take one from another observer.
void Mapper::remove_keyframe(KeyframeId id, SlamMap* map) {
  std::vector<PointId> orphans;
  for (const PointId point_id : map->keyframe(id)->point_ids) {
    if (map->point(point_id)->source.keyframe_id == id) orphans.push_back(point_id);
  }
  for (const PointId point_id : orphans) {
    std::optional<Corner> corner;
    for (const Observation& o : map->point(point_id)->observations) {
      if (o.keyframe_id == id || corner) continue;
      corner = make_corner(camera_, o.keyframe_id, {o.pixel, o.level});
    }
    if (corner) {
      map->set_source(point_id, *corner);
    } else {
      map->remove_point(point_id);
    }
  }
  seeds_.forget_keyframe(id);
  map->remove_keyframe(id);
}

void Mapper::apply(const MapCorrection& correction, const LoopClosure& closure, SlamMap* map) {
  correct_map(correction, map);
  for (const auto& [id, new_from_old] : correction) {
    seeds_.scale_keyframe(id, new_from_old.scale());
  }
  fuse_points(closure, map);
}

Similarity<Map, Map> Mapper::apply(const BundleProblem& problem, const BundleSolution& solution,
                                   SlamMap* map) {
  const MapCorrection moved = apply_solution(problem, solution, map);
  for (const auto& [id, new_from_old] : moved) seeds_.scale_keyframe(id, new_from_old.scale());
  return moved.empty() ? Similarity<Map, Map>() : moved.rbegin()->second;
}

}  // namespace foresight::slam
