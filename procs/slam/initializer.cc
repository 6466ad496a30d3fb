#include "procs/slam/initializer.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/video/tracking.hpp>

#include "procs/slam/bundle_adjustment.h"
#include "procs/slam/geometry.h"
#include "procs/slam/pose_optimizer.h"
#include "procs/slam/two_view.h"

namespace foresight::slam {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr size_t kMaxImages = 120;       // since the reference: then it starts anew
constexpr double kMinAliveShare = 0.35;  // of the reference's corners
constexpr double kMinFlow_px = 6;
constexpr double kTrackNoise_px = 0.8;
constexpr double kMaxTwoViewError_px = 3;
constexpr double kMinInlierShare = 0.75;
constexpr double kUnambiguous = 1.25;    // cost of the next best motion / of the best
constexpr double kBeyondRotation = 2.0;  // residual of a pure rotation / of the motion
constexpr double kSaneDepth = 50;        // times the median
constexpr double kMaxDepth = 1000;       // baselines

template <class... Args>
std::string format(const char* pattern, Args... args) {
  char text[160];
  std::snprintf(text, sizeof text, pattern, args...);
  return text;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

struct Initializer::Solution {
  Pose<Cam, Cam> second_from_first;
  std::vector<size_t> tracks;    // index of each point's track
  std::vector<Vector3d> points;  // in the first camera
  double cost = 0;               // Σ over tracks and images of min(error², limit²), px²
  double rms_px = 0;
  double parallax_deg = 0;  // median

  bool differs_from(const Solution& other) const {
    const Pose<Cam, Cam>& a = second_from_first;
    const Pose<Cam, Cam>& b = other.second_from_first;
    return a.rotation().angularDistance(b.rotation()) > 1.5 * kDegree ||
           angle_between(a.translation(), b.translation()) > 12 * kDegree;
  }
};

Initializer::Initializer(const CameraModel& camera, const SlamOptions& options)
    : camera_(camera), options_(options) {}

void Initializer::start_reference(Time time, const ImagePyramid& pyramid) {
  tracks_.clear();
  OccupancyMask mask(camera_.width_px, camera_.height_px);
  for (const DetectedCorner& c : detect_corners(pyramid, options_.init_corners, &mask)) {
    tracks_.push_back(
        {c, {cv::Point2f(static_cast<float>(c.pixel.x()), static_cast<float>(c.pixel.y()))}});
  }
  started_with_ = tracks_.size();
  reference_time_ = time;
  reference_ = last_ = pyramid;
}

void Initializer::follow(const ImagePyramid& pyramid) {
  std::vector<cv::Point2f> from, to, back;
  for (const Track& t : tracks_) from.push_back(t.path.back());
  std::vector<uchar> forward_ok, back_ok;
  std::vector<float> error;
  const cv::Size window(13, 13);
  cv::calcOpticalFlowPyrLK(last_.levels[0], pyramid.levels[0], from, to, forward_ok, error, window);
  back = from;
  cv::calcOpticalFlowPyrLK(
      pyramid.levels[0], last_.levels[0], to, back, back_ok, error, window, 3,
      cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 30, 0.01),
      cv::OPTFLOW_USE_INITIAL_FLOW);
  std::vector<Track> alive;
  for (size_t i = 0; i < tracks_.size(); ++i) {
    const cv::Point2f gap = back[i] - from[i];
    if (!forward_ok[i] || !back_ok[i] || gap.dot(gap) > 0.7f * 0.7f) continue;
    if (!camera_.in_image({to[i].x, to[i].y}, 5)) continue;
    alive.push_back(std::move(tracks_[i]));
    alive.back().path.push_back(to[i]);
  }
  tracks_ = std::move(alive);
  last_ = pyramid;
}

double Initializer::median_flow_px() const {
  std::vector<double> lengths;
  for (const Track& t : tracks_) lengths.push_back(cv::norm(t.path.back() - t.path.front()));
  return median(std::move(lengths));
}

std::vector<Vector2d> Initializer::rays_at(size_t image) const {
  std::vector<Vector2d> rays;
  for (const Track& t : tracks_) {
    rays.push_back(camera_.unproject({t.path[image].x, t.path[image].y}));
  }
  return rays;
}

std::vector<size_t> Initializer::views_between() const {
  const size_t last = tracks_.front().path.size() - 1;
  std::vector<size_t> views = {0};
  for (const size_t quarter : {1u, 2u, 3u}) {
    const size_t view = last * quarter / 4;
    if (view > views.back()) views.push_back(view);
  }
  if (last > views.back()) views.push_back(last);
  return views;
}

// The first solution: points where the rays of the first and the last view meet.
Initializer::Solution Initializer::triangulate_tracks(const Pose<Cam, Cam>& second_from_first,
                                                      const RaysPerView& rays) const {
  Solution solution;
  solution.second_from_first = second_from_first;
  for (size_t i = 0; i < tracks_.size(); ++i) {
    const auto point = triangulate(second_from_first, rays.front()[i], rays.back()[i]);
    if (!point || point->z() > kMaxDepth) continue;
    const Vector3d in_second = second_from_first * *point;
    const double error =
        camera_.fx_px * (in_second.head<2>() / in_second.z() - rays.back()[i]).norm();
    if (error > kMaxTwoViewError_px) continue;
    solution.tracks.push_back(i);
    solution.points.push_back(*point);
  }
  return solution;
}

// All views; those in between start from their own pose optimisation.
BundleProblem Initializer::bundle_over_views(const Solution& solution,
                                             const RaysPerView& rays) const {
  const double f = camera_.fx_px;
  BundleProblem problem;
  problem.max_iterations = 12;
  for (size_t n = 0; n < solution.points.size(); ++n) {
    problem.points.push_back({static_cast<int32_t>(n), solution.points[n]});
  }
  for (size_t v = 0; v < rays.size(); ++v) {
    const double share = static_cast<double>(v) / static_cast<double>(rays.size() - 1);
    const Pose<Cam, Cam> guess = scaled_motion(solution.second_from_first, share).inverse();
    Pose<Map, Cam> pose(guess.rotation(), guess.translation());
    std::vector<PoseObservation> observations;
    for (size_t n = 0; n < solution.tracks.size(); ++n) {
      const Vector2d& xy = rays[v][solution.tracks[n]];
      observations.push_back({solution.points[n], xy, f});
      problem.observations.push_back({static_cast<int32_t>(v), static_cast<int32_t>(n), xy, f});
    }
    const bool between = v > 0 && v + 1 < rays.size();
    if (between) pose = optimize_pose(pose, observations).map_from_cam;
    problem.keyframes.push_back(
        {static_cast<int32_t>(v), v == 0 ? BundleRole::kFixed : BundleRole::kAdjusted, pose});
  }
  return problem;
}

std::optional<Initializer::Solution> Initializer::refine(const Pose<Cam, Cam>& second_from_first,
                                                         const RaysPerView& rays) const {
  const Solution start = triangulate_tracks(second_from_first, rays);
  if (start.points.size() < static_cast<size_t>(options_.init_min_points)) return std::nullopt;
  const BundleProblem problem = bundle_over_views(start, rays);
  const BundleSolution adjusted = adjust_bundle(problem);
  if (!adjusted.usable) return std::nullopt;

  Solution refined;
  const Pose<Map, Cam>& second = adjusted.keyframes.back().map_from_cam;
  refined.second_from_first = Pose<Cam, Cam>(second.rotation(), second.translation()).inverse();
  refined.rms_px = adjusted.rms_px;
  const size_t inliers = problem.observations.size() - adjusted.outliers.size();
  const size_t others = tracks_.size() * rays.size() - inliers;
  refined.cost = static_cast<double>(inliers) * adjusted.rms_px * adjusted.rms_px +
                 static_cast<double>(others) * problem.outlier_px * problem.outlier_px;
  std::vector<bool> bad(problem.points.size(), false);
  for (const int32_t o : adjusted.outliers) {
    bad[static_cast<size_t>(problem.observations[static_cast<size_t>(o)].point_index)] = true;
  }
  std::vector<double> parallax;
  for (size_t n = 0; n < adjusted.points.size(); ++n) {
    const Vector3d& p = adjusted.points[n].position_in_map;
    if (bad[n] || p.z() <= 0) continue;
    refined.tracks.push_back(start.tracks[n]);
    refined.points.push_back(p);
    parallax.push_back(angle_between(p, p - second.translation()) / kDegree);
  }
  refined.parallax_deg = median(std::move(parallax));
  return refined;
}

std::vector<Initializer::Solution> Initializer::refined_candidates(const RaysPerView& rays) const {
  std::vector<Pose<Cam, Cam>> motions =
      candidate_motions(rays.front(), rays.back(), kTrackNoise_px / camera_.fx_px);
  std::vector<std::pair<size_t, Pose<Cam, Cam>>> ranked;
  for (const Pose<Cam, Cam>& m : motions) {
    size_t good = 0;
    for (size_t i = 0; i < tracks_.size(); ++i) {
      const auto p = triangulate(m, rays.front()[i], rays.back()[i]);
      if (!p) continue;
      const Vector3d q = m * *p;
      const double error = camera_.fx_px * (q.head<2>() / q.z() - rays.back()[i]).norm();
      if (error < kMaxTwoViewError_px) ++good;
    }
    ranked.emplace_back(good, m);
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<Solution> solutions;
  for (const auto& [good, motion] : ranked) {
    if (4 * good < 3 * ranked.front().first) break;
    if (auto solution = refine(motion, rays)) solutions.push_back(std::move(*solution));
  }
  std::stable_sort(solutions.begin(), solutions.end(),
                   [](const Solution& a, const Solution& b) { return a.cost < b.cost; });
  return solutions;
}

Initializer::Outcome Initializer::attempt(Time time, const ImagePyramid& pyramid) {
  RaysPerView rays;
  for (const size_t view : views_between()) rays.push_back(rays_at(view));
  const std::vector<Solution> solutions = refined_candidates(rays);
  if (solutions.empty()) return {std::nullopt, "no two-view motion explains the tracks"};
  const Solution& best = solutions.front();
  const double share =
      static_cast<double>(best.tracks.size()) / static_cast<double>(tracks_.size());
  if (best.parallax_deg < options_.init_min_parallax_deg) {
    return {std::nullopt, format("parallax %.1f deg, need %.1f", best.parallax_deg,
                                 options_.init_min_parallax_deg)};
  }
  if (best.tracks.size() < static_cast<size_t>(options_.init_min_points) ||
      share < kMinInlierShare) {
    return {std::nullopt, format("%zu points (%.0f %% of the tracks) fit, need %d and %.0f %%",
                                 best.tracks.size(), 100 * share, options_.init_min_points,
                                 100 * kMinInlierShare)};
  }
  if (best.rms_px > options_.init_max_rms_px) {
    return {std::nullopt,
            format("reprojection error %.1f px, need %.1f", best.rms_px, options_.init_max_rms_px)};
  }
  const double rotation_px = camera_.fx_px * rotation_only_residual(rays.front(), rays.back());
  if (rotation_px < kBeyondRotation * std::max(best.rms_px, 0.5)) {
    return {std::nullopt, format("a pure rotation explains the tracks to %.1f px", rotation_px)};
  }
  for (const Solution& other : solutions) {
    if (other.differs_from(best) && other.cost < kUnambiguous * best.cost) {
      return {std::nullopt, "two motions explain the tracks about equally well"};
    }
  }
  return {make_map(best, time, pyramid), ""};
}

InitialMap Initializer::make_map(const Solution& solution, Time time,
                                 const ImagePyramid& pyramid) const {
  std::vector<double> depths;
  for (const Vector3d& p : solution.points) depths.push_back(p.z());
  const double scale = 1 / median(std::move(depths));
  InitialMap map;
  map.first = {reference_time_, reference_, Pose<Map, Cam>()};
  const Pose<Cam, Cam> motion = solution.second_from_first.inverse();
  map.second = {time, pyramid, Pose<Map, Cam>(motion.rotation(), scale * motion.translation())};
  for (size_t n = 0; n < solution.points.size(); ++n) {
    const Vector3d position = scale * solution.points[n];
    if (position.z() > kSaneDepth) continue;
    const Track& track = tracks_[solution.tracks[n]];
    map.points.push_back(
        {track.corner, Vector2d(track.path.back().x, track.path.back().y), position});
  }
  return map;
}

Initializer::Outcome Initializer::feed(Time time, const ImagePyramid& pyramid) {
  const size_t needed = static_cast<size_t>(options_.init_min_points);
  if (tracks_.empty()) {
    start_reference(time, pyramid);
    return {std::nullopt, tracks_.size() < needed
                              ? format("%zu corners, need %zu", tracks_.size(), needed)
                              : "new reference image"};
  }
  follow(pyramid);
  if (tracks_.size() < needed ||
      static_cast<double>(tracks_.size()) < kMinAliveShare * static_cast<double>(started_with_) ||
      tracks_.front().path.size() > kMaxImages) {
    const std::string why =
        format("%zu of %zu tracks left: new reference image", tracks_.size(), started_with_);
    start_reference(time, pyramid);
    return {std::nullopt, why};
  }
  const double flow_px = median_flow_px();
  if (flow_px < kMinFlow_px || tracks_.front().path.size() < 4) {
    return {std::nullopt, format("the image moved %.1f px, need %.0f", flow_px, kMinFlow_px)};
  }
  return attempt(time, pyramid);
}

}  // namespace foresight::slam
