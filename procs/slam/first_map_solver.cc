#include "procs/slam/first_map_solver.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "procs/slam/bundle_adjustment.h"
#include "procs/slam/geometry.h"
#include "procs/slam/pose_optimizer.h"
#include "procs/slam/two_view.h"

namespace foresight::slam {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTrackNoise_px = 0.8;
constexpr double kMaxTwoViewError_px = 3;
constexpr double kFar = 3000;  // baselines: where rays that do not meet may meet
constexpr double kBehind_px = 1e6;
constexpr double kLimit_px = 3;                           // of a track's error in any view
constexpr double kKeptShare = 0.95;                       // of the tracks, in a solution's cost
constexpr size_t kMaxRefined = 6;                         // motions
constexpr double kHopeless_px2 = 1, kHopelessRatio = 20;  // two-view cost, also against the best

class Solver {
 public:
  explicit Solver(const TracksInViews& tracks) : in_(tracks) {}

  std::vector<TwoViewSolution> solve() const {
    std::vector<TwoViewSolution> solutions;
    for (const Pose<Cam, Cam>& motion : proposals()) {
      if (auto solution = refine(motion)) solutions.push_back(std::move(*solution));
    }
    std::stable_sort(
        solutions.begin(), solutions.end(),
        [](const TwoViewSolution& a, const TwoViewSolution& b) { return a.cost < b.cost; });
    return solutions;
  }

 private:
  size_t track_count() const { return in_.rays.front().size(); }
  const Vector2d& first(size_t track) const { return in_.rays.front()[track]; }
  const Vector2d& last(size_t track) const { return in_.rays.back()[track]; }

  Vector3d triangulate_or_far(const Pose<Cam, Cam>& second_from_first, size_t track,
                              double* error_px) const;
  double two_view_cost(const Pose<Cam, Cam>& motion) const;
  std::vector<Pose<Cam, Cam>> proposals() const;
  double trimmed_cost(std::vector<double> costs) const;
  TwoViewSolution triangulate_tracks(const Pose<Cam, Cam>& second_from_first) const;
  std::vector<Pose<Map, Cam>> views_along(const TwoViewSolution& solution) const;
  BundleProblem bundle_over_views(const TwoViewSolution& solution) const;
  std::optional<TwoViewSolution> refine(const Pose<Cam, Cam>& second_from_first) const;

  const TracksInViews& in_;
};

// Where the rays of the first and the last view meet; rays that do not, within the noise, belong to
// a point that is far away. Its reprojection error in the last view, px, goes to `error_px`.
Vector3d Solver::triangulate_or_far(const Pose<Cam, Cam>& second_from_first, size_t track,
                                    double* error_px) const {
  const Vector3d far = kFar * second_from_first.translation().norm() * ray_from_xy(first(track));
  const auto met = triangulate(second_from_first, first(track), last(track));
  const Vector3d point = met && met->z() < far.z() ? *met : far;
  const Vector3d in_second = second_from_first * point;
  *error_px = in_second.z() > 0
                  ? in_.focal_px * (in_second.head<2>() / in_second.z() - last(track)).norm()
                  : kBehind_px;
  return point;
}

// Mean over the tracks of the squared reprojection error, limited, px².
double Solver::two_view_cost(const Pose<Cam, Cam>& motion) const {
  double cost = 0;
  for (size_t i = 0; i < track_count(); ++i) {
    double error_px;
    triangulate_or_far(motion, i, &error_px);
    error_px = std::min(error_px, kMaxTwoViewError_px);
    cost += error_px * error_px;
  }
  return cost / static_cast<double>(track_count());
}

// Motions to refine, the cheapest first, without near duplicates and without those far off.
std::vector<Pose<Cam, Cam>> Solver::proposals() const {
  const double noise = kTrackNoise_px / in_.focal_px;
  std::vector<Pose<Cam, Cam>> motions = in_.hypotheses;
  for (const auto& source : {small_motions(in_.rays.front(), in_.rays.back(), noise),
                             candidate_motions(in_.rays.front(), in_.rays.back(), noise)}) {
    motions.insert(motions.end(), source.begin(), source.end());
  }
  std::vector<std::pair<double, Pose<Cam, Cam>>> ranked;
  for (const Pose<Cam, Cam>& m : motions) ranked.emplace_back(two_view_cost(m), m);
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<Pose<Cam, Cam>> chosen;
  for (const auto& [cost, motion] : ranked) {
    if (chosen.size() == kMaxRefined) break;
    if (cost > kHopeless_px2 && cost > kHopelessRatio * ranked.front().first) break;
    const bool known = std::any_of(chosen.begin(), chosen.end(), [&](const Pose<Cam, Cam>& other) {
      return motion.rotation().angularDistance(other.rotation()) < 0.3 * kDegree &&
             angle_between(motion.translation(), other.translation()) < 8 * kDegree;
    });
    if (!known) chosen.push_back(motion);
  }
  return chosen;
}

TwoViewSolution Solver::triangulate_tracks(const Pose<Cam, Cam>& second_from_first) const {
  TwoViewSolution solution;
  solution.second_from_first = second_from_first;
  for (size_t i = 0; i < track_count(); ++i) {
    double error_px;
    const Vector3d point = triangulate_or_far(second_from_first, i, &error_px);
    if (error_px > kMaxTwoViewError_px) continue;
    solution.tracks.push_back(i);
    solution.points.push_back(point);
  }
  return solution;
}

// A pose for each view; those in between start from their own pose optimisation.
std::vector<Pose<Map, Cam>> Solver::views_along(const TwoViewSolution& solution) const {
  std::vector<Pose<Map, Cam>> views;
  for (size_t v = 0; v < in_.rays.size(); ++v) {
    const double share = static_cast<double>(v) / static_cast<double>(in_.rays.size() - 1);
    const Pose<Cam, Cam> guess = scaled_motion(solution.second_from_first, share).inverse();
    Pose<Map, Cam> pose(guess.rotation(), guess.translation());
    if (v > 0 && v + 1 < in_.rays.size()) {
      std::vector<PoseObservation> observations;
      for (size_t n = 0; n < solution.tracks.size(); ++n) {
        observations.push_back({solution.points[n], in_.rays[v][solution.tracks[n]], in_.focal_px});
      }
      pose = optimize_pose(pose, observations).map_from_cam;
    }
    views.push_back(pose);
  }
  return views;
}

BundleProblem Solver::bundle_over_views(const TwoViewSolution& solution) const {
  BundleProblem problem;
  problem.max_iterations = 12;
  const std::vector<Pose<Map, Cam>> views = views_along(solution);
  for (size_t v = 0; v < views.size(); ++v) {
    problem.keyframes.push_back(
        {KeyframeId::at(v), v == 0 ? BundleRole::kFixed : BundleRole::kAdjusted, views[v]});
  }
  for (size_t n = 0; n < solution.points.size(); ++n) {
    const Vector3d& point = solution.points[n];
    const bool before_all = std::all_of(views.begin(), views.end(), [&](const Pose<Map, Cam>& v) {
      return (v.inverse() * point).z() > 1e-3 * point.z();
    });
    const BundlePointIndex index = problem.points.push_back({PointId::at(n), point});
    for (size_t v = 0; v < views.size() && before_all; ++v) {
      problem.observations.push_back(
          {BundleKeyframeIndex::at(v), index, in_.rays[v][solution.tracks[n]], in_.focal_px});
    }
  }
  return problem;
}

// Each point's mean squared error over the views, px²; the limit for an outlier in any of them.
std::vector<double> point_costs(const BundleProblem& problem, const BundleSolution& solution) {
  std::vector<double> sums(problem.points.size(), 0), worst(problem.points.size(), 0);
  std::vector<int> counts(problem.points.size(), 0);
  IdVector<BundleKeyframeIndex, Pose<Cam, Map>> cam_from_map;
  for (const BundleKeyframe& k : solution.keyframes) {
    cam_from_map.push_back(k.map_from_cam.inverse());
  }
  for (const BundleObservation& o : problem.observations) {
    const size_t n = o.point.index();
    const Vector3d p = cam_from_map[o.keyframe] * solution.points[o.point].position_in_map;
    const double error_px =
        p.z() > 0 ? o.scale_px * (p.head<2>() / p.z() - o.xy).norm() : kBehind_px;
    worst[n] = std::max(worst[n], error_px);
    sums[n] += error_px * error_px;
    ++counts[n];
  }
  for (size_t n = 0; n < sums.size(); ++n) {
    const bool outlier = counts[n] == 0 || worst[n] > kLimit_px;
    sums[n] = outlier ? kLimit_px * kLimit_px : sums[n] / counts[n];
  }
  return sums;
}

// Mean over the better tracks; those that no motion explains say nothing about this one.
double Solver::trimmed_cost(std::vector<double> costs) const {
  costs.resize(track_count(), kLimit_px * kLimit_px);
  std::sort(costs.begin(), costs.end());
  const auto kept = static_cast<size_t>(kKeptShare * static_cast<double>(costs.size()));
  double sum = 0;
  for (size_t i = 0; i < kept; ++i) sum += costs[i];
  return sum / static_cast<double>(std::max<size_t>(1, kept));
}

std::optional<TwoViewSolution> Solver::refine(const Pose<Cam, Cam>& second_from_first) const {
  const TwoViewSolution start = triangulate_tracks(second_from_first);
  if (start.points.size() < static_cast<size_t>(in_.min_points)) return std::nullopt;
  const BundleProblem problem = bundle_over_views(start);
  const BundleSolution adjusted = adjust_bundle(problem);
  if (!adjusted.usable) return std::nullopt;

  TwoViewSolution refined;
  const Pose<Map, Cam>& second = adjusted.keyframes.back().map_from_cam;
  refined.second_from_first = Pose<Cam, Cam>(second.rotation(), second.translation()).inverse();
  refined.rms_px = adjusted.rms_px;
  const std::vector<double> costs = point_costs(problem, adjusted);
  refined.cost = trimmed_cost(costs);
  std::vector<double> parallax;
  for (size_t n = 0; n < adjusted.points.size(); ++n) {
    const Vector3d& p = adjusted.points[BundlePointIndex::at(n)].position_in_map;
    if (costs[n] >= kLimit_px * kLimit_px || p.z() <= 0) continue;
    refined.tracks.push_back(start.tracks[n]);
    refined.points.push_back(p);
    parallax.push_back(angle_between(p, p - second.translation()) / kDegree);
  }
  refined.parallax_deg = median(std::move(parallax));
  return refined;
}

}  // namespace

bool differ(const Pose<Cam, Cam>& a, const Pose<Cam, Cam>& b) {
  return a.rotation().angularDistance(b.rotation()) > 1.5 * kDegree ||
         angle_between(a.translation(), b.translation()) > 12 * kDegree;
}

std::vector<TwoViewSolution> solve_first_map(const TracksInViews& tracks) {
  return Solver(tracks).solve();
}

}  // namespace foresight::slam
