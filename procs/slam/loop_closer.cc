#include "procs/slam/loop_closer.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include "procs/slam/geometry.h"
#include "procs/slam/tracker.h"
#include "procs/slam/view_candidates.h"

namespace foresight::slam {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kSharedPoints = 10;     // so many: the two see the same and know it
constexpr size_t kSideKeyframes = 6;  // of each side
constexpr size_t kCandidates = 3;     // old sides looked at
constexpr size_t kMinKeyframes = 12;  // a smaller map has no loop
constexpr double kAsSimilar = 0.8;    // votes / those of the least similar neighbour
constexpr double kSamePlace_px = 4;   // of an old and a new point in one image
constexpr size_t kMinScalePairs = 8;
constexpr size_t kMinViews = 3;  // of the new side, placed
constexpr size_t kMinObservations = 90;
constexpr double kMinQuality = 0.7;       // of the newest view among old points, and the reverse
constexpr double kMinViewQuality = 0.45;  // of the other views, which see the place's edge
constexpr size_t kMinViewInliers = 25;
constexpr double kMaxScale = 2, kMaxTurnDeg = 30;  // drift by more is not believed
constexpr double kMaxDrift = 0.2;                  // share of the way between
constexpr double kMaxRms_px = 1.5;
constexpr double kHuber_px = 1.5, kOutlier_px = 3;
constexpr int kIterations = 15;

std::vector<KeyframeId> neighbours(const SlamMap& map, KeyframeId keyframe_id, size_t count,
                                   const std::set<KeyframeId>& excluded) {
  const std::map<KeyframeId, int> shared =
      shared_point_counts(map, map.keyframe(keyframe_id)->point_ids);
  std::vector<std::pair<int, KeyframeId>> ranked;
  for (const auto& [id, points] : shared) {
    if (id != keyframe_id && points >= kSharedPoints && !excluded.contains(id)) {
      ranked.emplace_back(-points, id);
    }
  }
  std::sort(ranked.begin(), ranked.end());
  std::vector<KeyframeId> ids = {keyframe_id};
  for (const auto& [points, id] : ranked) {
    if (ids.size() < count) ids.push_back(id);
  }
  return ids;
}

// All that share points with one of these.
std::set<KeyframeId> connected(const SlamMap& map, const std::vector<KeyframeId>& keyframe_ids) {
  std::set<KeyframeId> ids;
  for (const KeyframeId of : keyframe_ids) {
    for (const auto& [id, points] : shared_point_counts(map, map.keyframe(of)->point_ids)) {
      if (points >= kSharedPoints) ids.insert(id);
    }
  }
  return ids;
}

// These keyframes, what they see, and the images that the points' patches are from.
SlamMap part_of(const SlamMap& map, const std::set<KeyframeId>& keyframe_ids) {
  std::set<PointId> point_ids;
  std::set<KeyframeId> needed = keyframe_ids;
  for (const KeyframeId id : keyframe_ids) {
    for (const PointId point_id : map.keyframe(id)->point_ids) {
      point_ids.insert(point_id);
      needed.insert(map.point(point_id)->source.keyframe_id);
    }
  }
  SlamMap part;
  for (const KeyframeId id : needed) {
    Keyframe keyframe = *map.keyframe(id);
    keyframe.point_ids.clear();
    part.restore_keyframe(std::move(keyframe));
  }
  for (const PointId id : point_ids) {
    Point point = *map.point(id);
    std::erase_if(point.observations,
                  [&](const Observation& o) { return !needed.contains(o.keyframe_id); });
    part.restore_point(std::move(point));
  }
  return part;
}

// The part of a map that these keyframes see and those do not.
SlamMap seen_by_only(const SlamMap& map, const std::vector<KeyframeId>& keyframe_ids,
                     const std::vector<KeyframeId>& others) {
  SlamMap part = part_of(map, {keyframe_ids.begin(), keyframe_ids.end()});
  for (const KeyframeId id : others) {
    for (const PointId point_id : map.keyframe(id)->point_ids) {
      if (part.point(point_id) != nullptr) part.remove_point(point_id);
    }
  }
  return part;
}

// Along the keyframes in the order in which they were made.
double way_between(const SlamMap& map, KeyframeId older, KeyframeId newer) {
  const std::map<KeyframeId, Keyframe>& all = map.keyframes();
  double way = 0;
  for (auto k = all.find(older); k->first != newer; ++k) {
    const auto next = std::next(k);
    way += (next->second.map_from_cam.translation() - k->second.map_from_cam.translation()).norm();
  }
  return way;
}

double depth_in(const Pose<Map, Cam>& map_from_cam, const Vector3d& point_in_map) {
  return (map_from_cam.inverse() * point_in_map).z();
}

// How much larger the old side's geometry is: depths of points that are in one place in the image.
std::optional<double> scale_between(const SlamMap& map, const Keyframe& keyframe,
                                    const TrackingAttempt& placed, const SlamMap& old) {
  std::vector<double> ratios;
  for (const PointMatch& m : placed.inliers) {
    const Point* nearest = point_near(map, keyframe, m.observation.pixel, kSamePlace_px);
    if (nearest == nullptr) continue;
    const double here = depth_in(keyframe.map_from_cam, nearest->position_in_map);
    const double there = depth_in(placed.map_from_cam, old.point(m.point_id)->position_in_map);
    if (here > 0 && there > 0) ratios.push_back(there / here);
  }
  if (ratios.size() < kMinScalePairs) return std::nullopt;
  return median(std::move(ratios));
}

// A point of the old side as a keyframe of the new side saw it.
struct Sighting {
  Vector3d point_in_old;
  Pose<Cam, Map> cam_from_new;
  Vector2d xy;
  double scale_px = 1;
};

// Residual in px, and its derivative by a small similarity after new_from_old.
bool reproject(const Sighting& s, const Similarity<Map, Map>& new_from_old, Vector2d* residual,
               Eigen::Matrix<double, 2, 7>* jacobian) {
  const Vector3d x = new_from_old * s.point_in_old;
  const Vector3d p = s.cam_from_new * x;
  if (p.z() < 1e-6) return false;
  const Vector2d projected = p.head<2>() / p.z();
  *residual = s.scale_px * (projected - s.xy);
  if (jacobian == nullptr) return true;
  Eigen::Matrix<double, 2, 3> by_p;
  by_p << 1, 0, -projected.x(), 0, 1, -projected.y();
  by_p *= s.scale_px / p.z();
  Eigen::Matrix<double, 3, 7> by_step;
  by_step << Eigen::Matrix3d::Identity(), -skew(x), x;
  *jacobian = by_p * s.cam_from_new.rotation().toRotationMatrix() * by_step;
  return true;
}

// Root mean square of the sightings' errors below the outlier limit; their share to `inliers`.
double rms_px(const std::vector<Sighting>& sightings, const Similarity<Map, Map>& new_from_old,
              double* inliers) {
  double squared = 0, count = 0;
  for (const Sighting& s : sightings) {
    Vector2d residual;
    if (!reproject(s, new_from_old, &residual, nullptr) || residual.norm() > kOutlier_px) continue;
    squared += residual.squaredNorm();
    ++count;
  }
  *inliers = count / static_cast<double>(sightings.size());
  return std::sqrt(squared / std::max(1.0, count));
}

Similarity<Map, Map> refine(const std::vector<Sighting>& sightings,
                            Similarity<Map, Map> new_from_old) {
  for (int i = 0; i < kIterations; ++i) {
    Matrix7d information = Matrix7d::Zero();
    Vector7d gradient = Vector7d::Zero();
    for (const Sighting& s : sightings) {
      Vector2d residual;
      Eigen::Matrix<double, 2, 7> jacobian;
      if (!reproject(s, new_from_old, &residual, &jacobian)) continue;
      const double error = residual.norm(), weight = error < kHuber_px ? 1 : kHuber_px / error;
      information += weight * jacobian.transpose() * jacobian;
      gradient += weight * jacobian.transpose() * residual;
    }
    const Vector7d step = information.ldlt().solve(-gradient);
    if (!step.allFinite()) return new_from_old;
    new_from_old = small_similarity<Map>(step) * new_from_old;
    if (step.norm() < 1e-8) break;
  }
  return new_from_old;
}

class LoopCandidate {
 public:
  LoopCandidate(const CameraModel& camera, const SlamOptions& options, const LoopSearch& search,
                const LoopSearch::OldSide& old_side)
      : camera_(camera),
        options_(options),
        search_(search),
        old_side_(old_side.keyframe_ids),
        way_(old_side.way),
        old_(seen_by_only(search.map, old_side_, search.new_side)) {}

  std::optional<LoopClosure> close() {
    const Keyframe& keyframe = *search_.map.keyframe(search_.keyframe_id);
    const auto start =
        matched_view(camera_, old_, *keyframe.features, *old_.keyframe(old_side_[0]));
    if (!start) return std::nullopt;
    TrackingAttempt placed =
        track_points(camera_, old_, keyframe.pyramid, *start, SearchWidth::kWide, options_);
    if (placed.quality < kMinQuality ||
        placed.inliers.size() < static_cast<size_t>(options_.relocalise_min_inliers)) {
      return std::nullopt;
    }
    const auto scale = scale_between(search_.map, keyframe, placed, old_);
    if (!scale) return std::nullopt;
    old_from_new_ = between(placed.map_from_cam, *scale, keyframe.map_from_cam);
    note(keyframe, placed);
    place_others();
    return judge();
  }

 private:
  void note(const Keyframe& keyframe, const TrackingAttempt& placed) {
    closure_.new_side.push_back(keyframe.id);
    for (const PointMatch& m : placed.inliers) {
      LoopObservation seen{m.point_id, m.observation};
      seen.observation.keyframe_id = keyframe.id;
      closure_.observations.push_back(seen);
      sightings_.push_back({old_.point(m.point_id)->position_in_map,
                            keyframe.map_from_cam.inverse(), m.observation.xy,
                            m.observation.scale_px()});
    }
  }

  void place_others() {
    for (const KeyframeId id : search_.new_side) {
      if (id == search_.keyframe_id) continue;
      const Keyframe& keyframe = *search_.map.keyframe(id);
      const TrackingAttempt placed =
          track_points(camera_, old_, keyframe.pyramid, old_from_new_ * keyframe.map_from_cam,
                       SearchWidth::kNarrow, options_);
      if (placed.quality < kMinViewQuality || placed.inliers.size() < kMinViewInliers) continue;
      note(keyframe, placed);
    }
  }

  std::optional<LoopClosure> judge() {
    if (closure_.new_side.size() < kMinViews || sightings_.size() < kMinObservations) {
      return std::nullopt;
    }
    const Similarity<Map, Map> new_from_old = refine(sightings_, old_from_new_.inverse());
    double inliers = 0;
    closure_.rms_px = rms_px(sightings_, new_from_old, &inliers);
    if (inliers < kMinInliers || closure_.rms_px > kMaxRms_px || !can_be_drift(new_from_old) ||
        !found_in_reverse(new_from_old)) {
      return std::nullopt;
    }
    drop_outliers(new_from_old);
    closure_.keyframe_id = search_.keyframe_id;
    closure_.old_side = old_side_;
    closure_.old_from_new = new_from_old.inverse();
    return closure_;
  }

  bool can_be_drift(const Similarity<Map, Map>& new_from_old) const {
    const Pose<Map, Cam>& here = search_.map.keyframe(search_.keyframe_id)->map_from_cam;
    const Pose<Map, Cam> there = new_from_old.inverse() * here;
    const double turn_deg = here.rotation().angularDistance(there.rotation()) / kDegree;
    const double distance = (here.translation() - there.translation()).norm();
    return new_from_old.scale() < kMaxScale && new_from_old.scale() > 1 / kMaxScale &&
           turn_deg < kMaxTurnDeg && distance < kMaxDrift * way_;
  }

  // Does the old image show what the new side saw?
  bool found_in_reverse(const Similarity<Map, Map>& new_from_old) const {
    const SlamMap own = seen_by_only(search_.map, search_.new_side, old_side_);
    const Keyframe& keyframe = *search_.map.keyframe(old_side_[0]);
    const TrackingAttempt placed =
        track_points(camera_, own, keyframe.pyramid, new_from_old * keyframe.map_from_cam,
                     SearchWidth::kNarrow, options_);
    return placed.quality > kMinQuality &&
           placed.inliers.size() >= static_cast<size_t>(options_.relocalise_min_inliers);
  }

  void drop_outliers(const Similarity<Map, Map>& new_from_old) {
    std::vector<LoopObservation> kept;
    for (size_t i = 0; i < sightings_.size(); ++i) {
      Vector2d residual;
      if (reproject(sightings_[i], new_from_old, &residual, nullptr) &&
          residual.norm() < kOutlier_px) {
        kept.push_back(closure_.observations[i]);
      }
    }
    closure_.observations = std::move(kept);
  }

  static constexpr double kMinInliers = 0.7;  // share of the sightings

  const CameraModel& camera_;
  const SlamOptions& options_;
  const LoopSearch& search_;
  std::vector<KeyframeId> old_side_;
  double way_;
  SlamMap old_;
  Similarity<Map, Map> old_from_new_;
  std::vector<Sighting> sightings_;
  LoopClosure closure_;
};

}  // namespace

std::optional<LoopSearch> loop_search(const SlamMap& map, const PlaceIndex& places,
                                      KeyframeId keyframe_id) {
  const Keyframe* keyframe = map.keyframe(keyframe_id);
  if (keyframe == nullptr || !keyframe->features || map.keyframes().size() < kMinKeyframes) {
    return std::nullopt;
  }
  LoopSearch search;
  search.keyframe_id = keyframe_id;
  search.new_side = neighbours(map, keyframe_id, kSideKeyframes, {});
  const std::set<KeyframeId> near = connected(map, search.new_side);
  const std::set<KeyframeId> own_side(search.new_side.begin(), search.new_side.end());
  std::set<KeyframeId> ids = own_side;
  double least_similar = -1;  // of the new side
  const std::vector<PlaceIndex::Ranked> ranked = places.rank(*keyframe->features);
  for (const PlaceIndex::Ranked& r : ranked) {
    if (r.keyframe_id != keyframe_id && own_side.contains(r.keyframe_id)) least_similar = r.votes;
  }
  std::set<KeyframeId> taken = near;
  for (const PlaceIndex::Ranked& r : ranked) {
    if (r.votes < kAsSimilar * least_similar || search.old_sides.size() == kCandidates) break;
    if (taken.contains(r.keyframe_id) || r.keyframe_id > keyframe_id) continue;
    const std::vector<KeyframeId> side = neighbours(map, r.keyframe_id, kSideKeyframes, near);
    search.old_sides.push_back({side, way_between(map, r.keyframe_id, keyframe_id)});
    taken.insert(side.begin(), side.end());
    ids.insert(side.begin(), side.end());
  }
  if (search.old_sides.empty()) return std::nullopt;
  search.map = part_of(map, ids);
  return search;
}

std::optional<LoopClosure> find_loop(const CameraModel& camera, const SlamOptions& options,
                                     const LoopSearch& search) {
  for (const LoopSearch::OldSide& old_side : search.old_sides) {
    if (auto closure = LoopCandidate(camera, options, search, old_side).close()) return closure;
  }
  return std::nullopt;
}

}  // namespace foresight::slam
