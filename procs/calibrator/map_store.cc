#include "procs/calibrator/map_store.h"

namespace foresight::calibration {

void MapStore::clear() {
  keyframes_.clear();
  points_.clear();
}

void MapStore::apply(const MapDelta& delta) {
  for (const PointId id : delta.points_removed) points_.erase(id);
  for (const KeyframeId id : delta.keyframes_removed) keyframes_.erase(id);
  const auto is_possible = [](const auto& v) {
    return static_cast<double>(v.cwiseAbs().maxCoeff()) <= kMaxCoordinate_mu;
  };
  for (const MapKeyframe& k : delta.keyframes_set) {
    if (is_possible(k.map_from_cam.translation())) keyframes_[k.id] = k;
  }
  for (const MapPoint& p : delta.points_set) {
    if (is_possible(p.position_in_map)) points_[p.id] = p.position_in_map;
  }
}

const MapKeyframe* MapStore::find_keyframe(KeyframeId id) const {
  const auto it = keyframes_.find(id);
  return it == keyframes_.end() ? nullptr : &it->second;
}

const MapKeyframe* MapStore::nearest_keyframe(const Eigen::Vector3d& position_in_map) const {
  const MapKeyframe* nearest = nullptr;
  double nearest_mu2 = 0;
  for (const auto& [id, k] : keyframes_) {
    const double d = (k.map_from_cam.translation() - position_in_map).squaredNorm();
    if (nearest != nullptr && d >= nearest_mu2) continue;
    nearest = &k;
    nearest_mu2 = d;
  }
  return nearest;
}

std::vector<Eigen::Vector3f> MapStore::points_in_map() const {
  std::vector<Eigen::Vector3f> points;
  points.reserve(points_.size());
  for (const auto& [id, p] : points_) points.push_back(p);
  return points;
}

}  // namespace foresight::calibration
