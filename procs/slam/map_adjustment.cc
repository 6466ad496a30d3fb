#include "procs/slam/map_adjustment.h"

#include <algorithm>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "procs/slam/geometry.h"

namespace foresight::slam {
namespace {

using Eigen::Vector3d;

constexpr size_t kFocalKeyframes = 16, kFocalPoints = 500;
constexpr int kFocalIterations = 60;  // the valley is long
constexpr int kGlobalTies = 80;       // points that hold a keyframe when all are adjusted
constexpr int kGlobalIterations = 10;
constexpr int kMisfitObservations = 4;
constexpr double kMisfitRatio = 2.5;      // rms error / the median point's
constexpr double kMisfitFloor_px = 0.35;  // less is no misfit

// By how much the scene around each keyframe grew: median of its points' depths, new / old.
IdVector<BundleKeyframeIndex, double> depth_growth(const BundleProblem& problem,
                                                   const BundleSolution& solution) {
  const auto depth = [](const BundleKeyframe& k, const BundlePoint& p) {
    return (k.map_from_cam.inverse() * p.position_in_map).z();
  };
  IdVector<BundleKeyframeIndex, std::vector<double>> ratios(problem.keyframes.size());
  for (const BundleObservation& o : problem.observations) {
    const double before = depth(problem.keyframes[o.keyframe], problem.points[o.point]);
    const double after = depth(solution.keyframes[o.keyframe], solution.points[o.point]);
    if (before > 0 && after > 0) ratios[o.keyframe].push_back(after / before);
  }
  IdVector<BundleKeyframeIndex, double> growth;
  for (std::vector<double>& of_keyframe : ratios) growth.push_back(median(of_keyframe, 1));
  return growth;
}

// A point and those of its observations whose keyframes are in the problem, at these indices.
void add_point(const Point& point, const std::map<KeyframeId, BundleKeyframeIndex>& index,
               BundleProblem* problem) {
  const BundlePointIndex point_index = problem->points.push_back({point.id, point.position_in_map});
  for (const Observation& o : point.observations) {
    const auto it = index.find(o.keyframe_id);
    if (it == index.end()) continue;
    problem->observations.push_back({it->second, point_index, o.xy, o.scale_px()});
  }
}

// Points that many keyframes see, but none exactly there: patches across an object's outline, or
// things that move. The camera's own noise is the yardstick.
std::vector<PointId> misfits(const BundleSolution& solution) {
  std::vector<double> errors;
  for (const BundleSolution::Fit& fit : solution.fits) {
    if (fit.observations >= kMisfitObservations) errors.push_back(fit.rms_px);
  }
  const double limit = std::max(kMisfitFloor_px, kMisfitRatio * median(std::move(errors)));
  std::vector<PointId> ids;
  for (const BundlePointIndex i : solution.fits.ids()) {
    const BundleSolution::Fit& fit = solution.fits[i];
    if (fit.observations >= kMisfitObservations && fit.rms_px > limit) {
      ids.push_back(solution.points[i].id);
    }
  }
  return ids;
}

std::vector<KeyframeId> bundle_window(const SlamMap& map, const SlamOptions& options) {
  const Keyframe& newest = map.newest_keyframe();
  std::map<KeyframeId, int> shared = shared_point_counts(map, newest.point_ids);
  shared[newest.id] = std::numeric_limits<int>::max();
  std::vector<KeyframeId> window = first_few(by_count(shared), options.bundle_keyframes);
  std::sort(window.begin(), window.end());
  return window;
}

void carry_other_points(const BundleSolution& solution, const MapCorrection& moved, SlamMap* map) {
  std::set<PointId> adjusted;
  for (const BundlePoint& p : solution.points) adjusted.insert(p.id);
  std::vector<std::pair<PointId, Vector3d>> carried;
  for (const auto& [id, point] : map->points()) {
    const auto it = moved.find(point.source.keyframe_id);
    if (it == moved.end() || adjusted.contains(id)) continue;
    carried.emplace_back(id, it->second * point.position_in_map);
  }
  for (const auto& [id, position] : carried) map->move_point(id, position);
}

void remove_outliers(const BundleProblem& problem, const BundleSolution& solution, SlamMap* map) {
  std::set<PointId> doomed;
  for (const BundleObservation& observation : solution.outliers) {
    const PointId point_id = problem.points[observation.point].id;
    const KeyframeId keyframe_id = problem.keyframes[observation.keyframe].id;
    const Point* point = map->point(point_id);
    if (point == nullptr) continue;
    map->remove_observation(point_id, keyframe_id);
    map->count_outlier(point_id);
    const size_t left = point->observations.size();
    if (keyframe_id == point->source.keyframe_id || left < 2 ||
        static_cast<size_t>(3 * point->outlier_count) > left + point->outlier_count) {
      doomed.insert(point_id);
    }
  }
  for (const PointId id : misfits(solution)) {
    if (map->point(id) != nullptr) doomed.insert(id);
  }
  for (const PointId id : doomed) map->remove_point(id);
}

}  // namespace

BundleProblem bundle_problem(const SlamMap& map, const SlamOptions& options) {
  const std::vector<KeyframeId> window = bundle_window(map, options);
  std::set<PointId> point_ids;
  for (const KeyframeId id : window) {
    for (const PointId point_id : map.keyframe(id)->point_ids) {
      if (map.point(point_id)->observations.size() >= 2) point_ids.insert(point_id);
    }
  }
  std::map<KeyframeId, int> outside = shared_point_counts(map, point_ids);
  for (const KeyframeId id : window) outside.erase(id);
  const std::vector<KeyframeId> fixed = first_few(by_count(outside), options.bundle_max_fixed);

  BundleProblem problem;
  problem.max_iterations = options.bundle_iterations;
  problem.outlier_px = options.bundle_outlier_px;
  std::map<KeyframeId, BundleKeyframeIndex> index;
  const auto add = [&](KeyframeId id, BundleRole role) {
    index[id] = problem.keyframes.push_back({id, role, map.keyframe(id)->map_from_cam});
  };
  for (const KeyframeId id : window) {
    const bool anchor = fixed.empty() && id == window.front();
    add(id, anchor ? BundleRole::kFixed : BundleRole::kAdjusted);
  }
  problem.floats = fixed.empty();
  for (const KeyframeId id : fixed) add(id, BundleRole::kFixed);
  for (const PointId id : point_ids) add_point(*map.point(id), index, &problem);
  return problem;
}

BundleProblem focal_problem(const SlamMap& map, const SlamOptions& options) {
  std::map<KeyframeId, BundleKeyframeIndex> index;
  BundleProblem problem;
  problem.max_iterations = kFocalIterations;
  const size_t stride = (map.keyframes().size() + kFocalKeyframes - 1) / kFocalKeyframes;
  size_t n = 0;
  for (const auto& [id, k] : map.keyframes()) {
    if (n++ % stride != 0) continue;
    const BundleRole role = index.empty() ? BundleRole::kFixed : BundleRole::kAdjusted;
    index[id] = problem.keyframes.push_back({id, role, k.map_from_cam});
  }
  std::vector<const Point*> candidates;
  for (const auto& [id, point] : map.points()) {
    const auto seen =
        std::count_if(point.observations.begin(), point.observations.end(),
                      [&](const Observation& o) { return index.contains(o.keyframe_id); });
    if (point.confirmed && seen >= options.point_confirm_keyframes) candidates.push_back(&point);
  }
  const size_t every = std::max<size_t>(1, (candidates.size() + kFocalPoints - 1) / kFocalPoints);
  for (size_t i = 0; i < candidates.size(); i += every) {
    add_point(*candidates[i], index, &problem);
  }
  return problem;
}

// Each keyframe is tied by the points that most others see too; not by all of its points, which
// would cost several times as much.
BundleProblem global_problem(const SlamMap& map, const SlamOptions& options) {
  std::vector<std::pair<int, PointId>> ranked;
  for (const auto& [id, point] : map.points()) {
    const auto seen = static_cast<int>(point.observations.size());
    if (seen >= options.point_confirm_keyframes) ranked.emplace_back(-seen, id);
  }
  std::sort(ranked.begin(), ranked.end());
  BundleProblem problem;
  problem.max_iterations = kGlobalIterations;
  problem.floats = true;
  problem.outlier_px = options.bundle_outlier_px;
  std::map<KeyframeId, BundleKeyframeIndex> index;
  std::map<KeyframeId, int> tied;
  for (const auto& [id, k] : map.keyframes()) {
    const BundleRole role = index.empty() ? BundleRole::kFixed : BundleRole::kAdjusted;
    index[id] = problem.keyframes.push_back({id, role, k.map_from_cam});
  }
  for (const auto& [rank, id] : ranked) {
    const Point& point = *map.point(id);
    const bool needed =
        std::any_of(point.observations.begin(), point.observations.end(),
                    [&](const Observation& o) { return tied[o.keyframe_id] < kGlobalTies; });
    if (!needed) continue;
    for (const Observation& o : point.observations) ++tied[o.keyframe_id];
    add_point(point, index, &problem);
  }
  return problem;
}

MapCorrection apply_solution(const BundleProblem& problem, const BundleSolution& solution,
                             SlamMap* map) {
  if (!solution.usable) return {};
  const IdVector<BundleKeyframeIndex, double> growth = depth_growth(problem, solution);
  MapCorrection moved;
  for (const BundleKeyframeIndex i : solution.keyframes.ids()) {
    const BundleKeyframe& k = solution.keyframes[i];
    const Keyframe* keyframe = map->keyframe(k.id);
    if (keyframe == nullptr || (k.role == BundleRole::kFixed && !problem.floats)) continue;
    moved[k.id] = between(k.map_from_cam, growth[i], keyframe->map_from_cam);
    map->move_keyframe(k.id, k.map_from_cam);
    map->scale_depth(k.id, growth[i]);
  }
  carry_other_points(solution, moved, map);
  for (const BundlePoint& p : solution.points) {
    if (map->point(p.id) != nullptr) map->move_point(p.id, p.position_in_map);
  }
  remove_outliers(problem, solution, map);
  return moved;
}

}  // namespace foresight::slam
