// The part of the SLAM map that the calibrator needs: keyframes and points as they are now.
#pragma once

#include <map>
#include <vector>

#include "common/map_delta.h"

namespace foresight::calibration {

class MapStore {
 public:
  static constexpr double kMaxCoordinate_mu = 1e9;  // as the carver's
  void clear();
  /// O(changes · log map). Observations are not kept; coordinates beyond ± kMaxCoordinate_mu are
  /// those of a broken map and are passed over.
  void apply(const MapDelta& delta);

  const std::map<KeyframeId, MapKeyframe>& keyframes() const { return keyframes_; }
  const MapKeyframe* find_keyframe(KeyframeId id) const;
  /// The keyframe whose camera is nearest; null without any. O(keyframes).
  const MapKeyframe* nearest_keyframe(const Eigen::Vector3d& position_in_map) const;
  /// In order of their ids: the oldest first.
  std::vector<Eigen::Vector3f> points_in_map() const;

 private:
  std::map<KeyframeId, MapKeyframe> keyframes_;
  std::map<PointId, Eigen::Vector3f> points_;
};

}  // namespace foresight::calibration
