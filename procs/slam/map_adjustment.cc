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
std::vector<double> depth_growth(const BundleProblem& problem, const BundleSolution& solution) {
  const auto depth = [](const BundleKeyframe& k, const BundlePoint& p) {
    return (k.map_from_cam.inverse() * p.position_in_map).z();
  };
  std::vector<std::vector<double>> ratios(problem.keyframes.size());
  for (const BundleObservation& o : problem.observations) {
    const auto k = static_cast<size_t>(o.keyframe_index), p = static_cast<size_t>(o.point_index);
    const double before = depth(problem.keyframes[k], problem.points[p]);
    const double after = depth(solution.keyframes[k], solution.points[p]);
    if (before > 0 && after > 0) ratios[k].push_back(after / before);
  }
  std::vector<double> growth;
  for (std::vector<double>& of_keyframe : ratios) growth.push_back(median(of_keyframe, 1));
  return growth;
}

// A point and those of its observations whose keyframes are in the problem, at these indices.
void add_point(const Point& point, const std::map<int32_t, int32_t>& index,
               BundleProblem* problem) {
  const auto point_index = static_cast<int32_t>(problem->points.size());
  problem->points.push_back({point.id, point.position_in_map});
  for (const Observation& o : point.observations) {
    const auto it = index.find(o.keyframe_id);
    if (it == index.end()) continue;
    problem->observations.push_back({it->second, point_index, o.xy, o.scale_px()});
  }
}

// Points that many keyframes see, but none exactly there: patches across an object's outline, or
// things that move. The camera's own noise is the yardstick.
std::vector<int32_t> misfits(const BundleSolution& solution) {
  std::vector<double> errors;
  for (const BundleSolution::Fit& fit : solution.fits) {
    if (fit.observations >= kMisfitObservations) errors.push_back(fit.rms_px);
  }
  const double limit = std::max(kMisfitFloor_px, kMisfitRatio * median(std::move(errors)));
  std::vector<int32_t> ids;
  for (size_t i = 0; i < solution.fits.size(); ++i) {
    const BundleSolution::Fit& fit = solution.fits[i];
    if (fit.observations >= kMisfitObservations && fit.rms_px > limit) {
      ids.push_back(solution.points[i].id);
    }
  }
  return ids;
}

std::vector<int32_t> bundle_window(const SlamMap& map, const SlamOptions& options) {
  const Keyframe& newest = map.newest_keyframe();
  std::map<int32_t, int> shared = shared_point_counts(map, newest.point_ids);
  shared[newest.id] = std::numeric_limits<int>::max();
  std::vector<int32_t> window = first_few(by_count(shared), options.bundle_keyframes);
  std::sort(window.begin(), window.end());
  return window;
}

void carry_other_points(const BundleSolution& solution, const MapCorrection& moved, SlamMap* map) {
  std::set<int32_t> adjusted;
  for (const BundlePoint& p : solution.points) adjusted.insert(p.id);
  std::vector<std::pair<int32_t, Vector3d>> carried;
  for (const auto& [id, point] : map->points()) {
    const auto it = moved.find(point.source.keyframe_id);
    if (it == moved.end() || adjusted.contains(id)) continue;
    carried.emplace_back(id, it->second * point.position_in_map);
  }
  for (const auto& [id, position] : carried) map->move_point(id, position);
}

void remove_outliers(const BundleProblem& problem, const BundleSolution& solution, SlamMap* map) {
  std::set<int32_t> doomed;
  for (const int32_t o : solution.outliers) {
    const BundleObservation& observation = problem.observations[static_cast<size_t>(o)];
    const int32_t point_id = problem.points[static_cast<size_t>(observation.point_index)].id;
    const int32_t keyframe_id =
        problem.keyframes[static_cast<size_t>(observation.keyframe_index)].id;
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
  for (const int32_t id : misfits(solution)) {
    if (map->point(id) != nullptr) doomed.insert(id);
  }
  for (const int32_t id : doomed) map->remove_point(id);
}

}  // namespace

BundleProblem bundle_problem(const SlamMap& map, const SlamOptions& options) {
  const std::vector<int32_t> window = bundle_window(map, options);
  std::set<int32_t> point_ids;
  for (const int32_t id : window) {
    for (const int32_t point_id : map.keyframe(id)->point_ids) {
      if (map.point(point_id)->observations.size() >= 2) point_ids.insert(point_id);
    }
  }
  std::map<int32_t, int> outside = shared_point_counts(map, point_ids);
  for (const int32_t id : window) outside.erase(id);
  const std::vector<int32_t> fixed = first_few(by_count(outside), options.bundle_max_fixed);

  BundleProblem problem;
  problem.max_iterations = options.bundle_iterations;
  problem.outlier_px = options.bundle_outlier_px;
  std::map<int32_t, int32_t> index;
  const auto add = [&](int32_t id, BundleRole role) {
    index[id] = static_cast<int32_t>(problem.keyframes.size());
    problem.keyframes.push_back({id, role, map.keyframe(id)->map_from_cam});
  };
  for (const int32_t id : window) {
    const bool anchor = fixed.empty() && id == window.front();
    add(id, anchor ? BundleRole::kFixed : BundleRole::kAdjusted);
  }
  problem.floats = fixed.empty();
  for (const int32_t id : fixed) add(id, BundleRole::kFixed);
  for (const int32_t id : point_ids) add_point(*map.point(id), index, &problem);
  return problem;
}

BundleProblem focal_problem(const SlamMap& map, const SlamOptions& options) {
  std::map<int32_t, int32_t> index;
  BundleProblem problem;
  problem.max_iterations = kFocalIterations;
  const size_t stride = (map.keyframes().size() + kFocalKeyframes - 1) / kFocalKeyframes;
  size_t n = 0;
  for (const auto& [id, k] : map.keyframes()) {
    if (n++ % stride != 0) continue;
    index[id] = static_cast<int32_t>(problem.keyframes.size());
    const BundleRole role = index.size() == 1 ? BundleRole::kFixed : BundleRole::kAdjusted;
    problem.keyframes.push_back({id, role, k.map_from_cam});
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
  std::vector<std::pair<int, int32_t>> ranked;
  for (const auto& [id, point] : map.points()) {
    const auto seen = static_cast<int>(point.observations.size());
    if (seen >= options.point_confirm_keyframes) ranked.emplace_back(-seen, id);
  }
  std::sort(ranked.begin(), ranked.end());
  BundleProblem problem;
  problem.max_iterations = kGlobalIterations;
  problem.floats = true;
  problem.outlier_px = options.bundle_outlier_px;
  std::map<int32_t, int32_t> index, tied;  // by keyframe
  for (const auto& [id, k] : map.keyframes()) {
    const BundleRole role = index.empty() ? BundleRole::kFixed : BundleRole::kAdjusted;
    index[id] = static_cast<int32_t>(problem.keyframes.size());
    problem.keyframes.push_back({id, role, k.map_from_cam});
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
  const std::vector<double> growth = depth_growth(problem, solution);
  MapCorrection moved;
  for (size_t i = 0; i < solution.keyframes.size(); ++i) {
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
