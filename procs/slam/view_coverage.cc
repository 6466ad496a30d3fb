#include "procs/slam/view_coverage.h"

#include <cmath>

#include "procs/slam/geometry.h"

namespace foresight::slam {
namespace {

using Eigen::Vector3d;

constexpr int kEnough = 6;                          // keyframes that see it so
constexpr double kSameSideDeg = 5;                  // between their rays and the viewer's
constexpr double kNearest = 0.6, kFarthest = 1.25;  // of the viewer's distance

}  // namespace

ViewCoverage::ViewCoverage(const SlamMap& map) : map_(map) {
  if (map.empty()) return;
  centres_.assign(map.newest_keyframe().id.next().index(), Vector3d::Zero());
  for (const auto& [id, k] : map.keyframes()) {
    centres_[id] = k.map_from_cam.translation();
  }
}

bool ViewCoverage::covers(const Point& point, const Vector3d& viewer, KeyframeId besides) const {
  static const double kSameSide = std::pow(std::cos(kSameSideDeg * kDegree), 2);
  const Vector3d ray = point.position_in_map - viewer;
  const double squared = ray.squaredNorm();
  int enough = kEnough;
  for (const Observation& o : point.observations) {
    if (o.keyframe_id == besides) continue;
    const Vector3d other = point.position_in_map - centres_[o.keyframe_id];
    const double other_squared = other.squaredNorm(), along = ray.dot(other);
    if (other_squared < kNearest * kNearest * squared) continue;
    if (other_squared > kFarthest * kFarthest * squared) continue;
    if (along <= 0 || along * along < kSameSide * squared * other_squared) continue;
    if (--enough == 0) return true;
  }
  return false;
}

double ViewCoverage::share(const std::vector<const Point*>& points, const Vector3d& centre) const {
  if (points.empty()) return 1;
  int covered = 0;
  for (const Point* point : points) covered += covers(*point, centre, KeyframeId());
  return static_cast<double>(covered) / static_cast<double>(points.size());
}

double ViewCoverage::share(const Keyframe& keyframe) const {
  if (keyframe.point_ids.empty()) return 1;
  int covered = 0;
  for (const PointId id : keyframe.point_ids) {
    covered += covers(*map_.point(id), keyframe.map_from_cam.translation(), keyframe.id);
  }
  return static_cast<double>(covered) / static_cast<double>(keyframe.point_ids.size());
}

}  // namespace foresight::slam
