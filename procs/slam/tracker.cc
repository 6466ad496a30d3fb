#include "procs/slam/tracker.h"

#include <algorithm>
#include <map>
#include <tuple>

#include "procs/slam/pose_optimizer.h"

namespace foresight::slam {
namespace {

constexpr size_t kCoarsePoints = 100;
constexpr size_t kMinCoarseMatches = 12;
constexpr int kCell_px = 64;
constexpr double kFineRadius = 3.5;
constexpr double kBlurredShare = 0.6;    // found / expected: below, look one level up as well
constexpr double kTellingQuality = 0.5;  // of an attempt that says something about the points

struct Candidate {
  const Point* point;
  PatchView view;
};

std::vector<Candidate> visible_points(const PointFinder& finder, const SlamMap& map) {
  std::vector<Candidate> visible;
  for (const auto& [id, point] : map.points()) {
    if (auto view = finder.predict(point)) visible.push_back({&point, *view});
  }
  return visible;
}

// Round robin over image cells, the points that are found most reliably first.
std::vector<Candidate> select_spread(const std::vector<Candidate>& candidates, size_t count) {
  if (candidates.size() <= count) return candidates;
  std::map<std::pair<int, int>, std::vector<const Candidate*>> cells;
  for (const Candidate& c : candidates) {
    const int row = static_cast<int>(c.view.pixel.y()) / kCell_px;
    const int col = static_cast<int>(c.view.pixel.x()) / kCell_px;
    cells[{row, col}].push_back(&c);
  }
  for (auto& [cell, members] : cells) {
    std::sort(members.begin(), members.end(), [](const Candidate* a, const Candidate* b) {
      return std::tuple(-a->point->find_probability(), a->point->id) <
             std::tuple(-b->point->find_probability(), b->point->id);
    });
  }
  std::vector<Candidate> selected;
  for (size_t rank = 0; selected.size() < count; ++rank) {
    for (const auto& [cell, members] : cells) {
      if (rank < members.size() && selected.size() < count) selected.push_back(*members[rank]);
    }
  }
  return selected;
}

PoseEstimate pose_from_matches(const SlamMap& map, const Pose<Map, Cam>& start,
                               const std::vector<PointMatch>& matches) {
  std::vector<PoseObservation> observations;
  observations.reserve(matches.size());
  for (const PointMatch& m : matches) {
    observations.push_back(
        {map.point(m.point_id)->position_in_map, m.observation.xy, m.observation.scale_px()});
  }
  return optimize_pose(start, observations);
}

size_t count_inliers(const PoseEstimate& estimate, double max_error_px) {
  return static_cast<size_t>(std::count_if(estimate.error_px.begin(), estimate.error_px.end(),
                                           [&](double e) { return e < max_error_px; }));
}

Pose<Map, Cam> coarse_pose(const CameraModel& camera, const SlamMap& map,
                           const ImagePyramid& pyramid, const Pose<Map, Cam>& predicted,
                           SearchWidth width, const SlamOptions& options) {
  const PointFinder finder(camera, map, pyramid, predicted);
  const int target_level = width == SearchWidth::kWide ? 3 : 2;
  PointSearch search;
  search.radius_px = width == SearchWidth::kWide ? 10 : 6;
  search.min_zncc = options.min_zncc;
  std::vector<PointMatch> matches;
  for (const Candidate& c : select_spread(visible_points(finder, map), kCoarsePoints)) {
    search.extra_levels = std::max(0, target_level - c.view.level);
    if (auto match = finder.find(*c.point, c.view, search)) matches.push_back(*match);
  }
  if (matches.size() < kMinCoarseMatches) return predicted;
  const PoseEstimate estimate = pose_from_matches(map, predicted, matches);
  const size_t inliers = count_inliers(estimate, options.max_reprojection_error_px);
  return inliers >= std::max(kMinCoarseMatches, matches.size() / 3) ? estimate.map_from_cam
                                                                    : predicted;
}

struct FineSearch {
  std::vector<PointMatch> matches;
  std::vector<PointId> searched;
  double expected = 0;
};

FineSearch search_finely(const PointFinder& finder, const std::vector<Candidate>& candidates,
                         const SlamOptions& options) {
  FineSearch result;
  std::vector<const Candidate*> missed;
  const PointSearch search{kFineRadius, 0, options.min_zncc};
  for (const Candidate& c : candidates) {
    result.searched.push_back(c.point->id);
    result.expected += c.point->find_probability();
    if (auto match = finder.find(*c.point, c.view, search)) {
      result.matches.push_back(*match);
    } else {
      missed.push_back(&c);
    }
  }
  if (static_cast<double>(result.matches.size()) < kBlurredShare * result.expected) {
    const PointSearch blurred{kFineRadius, 1, options.min_zncc};
    for (const Candidate* c : missed) {
      if (auto match = finder.find(*c->point, c->view, blurred)) result.matches.push_back(*match);
    }
  }
  return result;
}

}  // namespace

TrackingAttempt track_points(const CameraModel& camera, const SlamMap& map,
                             const ImagePyramid& pyramid, const Pose<Map, Cam>& predicted,
                             SearchWidth width, const SlamOptions& options) {
  TrackingAttempt attempt;
  attempt.map_from_cam = coarse_pose(camera, map, pyramid, predicted, width, options);
  const PointFinder finder(camera, map, pyramid, attempt.map_from_cam);
  FineSearch fine = search_finely(
      finder,
      select_spread(visible_points(finder, map), static_cast<size_t>(options.max_tracked_points)),
      options);
  attempt.searched = std::move(fine.searched);
  std::sort(attempt.searched.begin(), attempt.searched.end());
  if (fine.matches.size() < 6) return attempt;
  const PoseEstimate estimate = pose_from_matches(map, attempt.map_from_cam, fine.matches);
  attempt.map_from_cam = estimate.map_from_cam;
  attempt.sigma_px = estimate.sigma_px;
  for (size_t i = 0; i < fine.matches.size(); ++i) {
    if (estimate.error_px[i] < options.max_reprojection_error_px) {
      attempt.inliers.push_back(fine.matches[i]);
    }
  }
  std::sort(attempt.inliers.begin(), attempt.inliers.end(),
            [](const PointMatch& a, const PointMatch& b) { return a.point_id < b.point_id; });
  const auto found = static_cast<double>(attempt.inliers.size());
  attempt.quality = std::min(1.0, found / std::max(1.0, fine.expected)) *
                    std::min(1.0, found / (2.0 * options.min_found_points));
  return attempt;
}

std::vector<PointMatch> find_remaining_points(const CameraModel& camera, const SlamMap& map,
                                              const ImagePyramid& pyramid,
                                              const Pose<Map, Cam>& map_from_cam,
                                              const std::vector<PointId>& already_searched,
                                              const SlamOptions& options) {
  const PointFinder finder(camera, map, pyramid, map_from_cam);
  const PointSearch search{kFineRadius, 0, options.min_zncc};
  std::vector<PointMatch> found;
  for (const auto& [id, point] : map.points()) {
    if (std::binary_search(already_searched.begin(), already_searched.end(), id)) continue;
    const auto view = finder.predict(point);
    if (!view) continue;
    const auto match = finder.find(point, *view, search);
    if (!match) continue;
    const double error_px =
        (match->observation.pixel - view->pixel).norm() / level_scale(match->observation.level);
    if (error_px < options.max_reprojection_error_px) found.push_back(*match);
  }
  return found;
}

void count_predictions(const TrackingAttempt& attempt, SlamMap* map) {
  if (attempt.quality < kTellingQuality) return;
  auto found = attempt.inliers.begin();
  for (const PointId id : attempt.searched) {
    while (found != attempt.inliers.end() && found->point_id < id) ++found;
    map->count_prediction(id, found != attempt.inliers.end() && found->point_id == id);
  }
}

}  // namespace foresight::slam
