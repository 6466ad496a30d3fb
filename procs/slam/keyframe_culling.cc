#include "procs/slam/keyframe_culling.h"

#include <limits>
#include <map>
#include <set>
#include <vector>

#include "procs/slam/geometry.h"
#include "procs/slam/view_coverage.h"

namespace foresight::slam {
namespace {

constexpr size_t kKeptKeyframes = 6;   // fewer are never culled
constexpr size_t kUnculledNewest = 3;  // nor are the newest
constexpr double kCrowded = 0.25;      // of the wanted baseline, to another keyframe
constexpr double kSameDirectionDeg = 15;
constexpr double kRedundant = 0.9;  // share of points that three others see
constexpr double kCovered = 0.8;    // share of points that are covered without it
constexpr int kLookedAt = 20;       // keyframes, after each new one

std::vector<KeyframeId> that_may_go(const SlamMap& map) {
  std::vector<KeyframeId> ids;
  for (const auto& [id, k] : map.keyframes()) ids.push_back(id);
  if (ids.size() < kKeptKeyframes) return {};
  ids.resize(ids.size() - kUnculledNewest);
  ids.erase(ids.begin());
  return ids;
}

bool stands_close(const SlamMap& map, const Keyframe& keyframe, double distance_in_depths) {
  for (const auto& [id, other] : map.keyframes()) {
    if (id == keyframe.id) continue;
    const Pose<Cam, Cam> between = other.map_from_cam.inverse() * keyframe.map_from_cam;
    if (between.translation().norm() < distance_in_depths * keyframe.median_depth &&
        between.rotation().angularDistance(Eigen::Quaterniond::Identity()) <
            kSameDirectionDeg * kDegree) {
      return true;
    }
  }
  return false;
}

double redundant_share(const SlamMap& map, const Keyframe& keyframe) {
  if (keyframe.point_ids.empty()) return 1;
  int redundant = 0;
  for (const PointId id : keyframe.point_ids) {
    if (map.point(id)->observations.size() > 3) ++redundant;
  }
  return static_cast<double>(redundant) / static_cast<double>(keyframe.point_ids.size());
}

// With the newest keyframe, which changed how much of them is covered.
std::set<KeyframeId> those_that_share_most(const SlamMap& map) {
  if (map.keyframes().size() <= kThriftyKeyframes) return {};
  const std::map<KeyframeId, int> shared =
      shared_point_counts(map, map.newest_keyframe().point_ids);
  const std::vector<KeyframeId> ids = first_few(by_count(shared), kLookedAt);
  return {ids.begin(), ids.end()};
}

// What would be lost: a point counts the less the more keyframes see it.
double need_of(const SlamMap& map, const Keyframe& keyframe) {
  double need = 0;
  for (const PointId id : keyframe.point_ids) {
    need += 1 / static_cast<double>(map.point(id)->observations.size());
  }
  return need;
}

}  // namespace

std::optional<KeyframeId> superfluous_keyframe(const SlamMap& map, const SlamOptions& options) {
  const std::vector<KeyframeId> ids = that_may_go(map);
  if (ids.empty()) return std::nullopt;
  const std::set<KeyframeId> perhaps_covered = those_that_share_most(map);
  const ViewCoverage coverage(map);
  for (const KeyframeId id : ids) {
    const Keyframe& keyframe = *map.keyframe(id);
    const bool crowded = stands_close(map, keyframe, kCrowded * options.keyframe_baseline) &&
                         redundant_share(map, keyframe) >= kRedundant;
    if (crowded) return id;
    if (perhaps_covered.contains(id) && coverage.share(keyframe) >= kCovered) return id;
  }
  return std::nullopt;
}

std::optional<KeyframeId> least_needed_keyframe(const SlamMap& map) {
  std::optional<KeyframeId> least_needed;
  double least = std::numeric_limits<double>::infinity();
  for (const KeyframeId id : that_may_go(map)) {
    const double need = need_of(map, *map.keyframe(id));
    if (need >= least) continue;
    least = need;
    least_needed = id;
  }
  return least_needed;
}

}  // namespace foresight::slam
