#include "bench/evaluate/map_points.h"

#include "common/message_bytes.h"
#include "common/messages.h"

namespace foresight {

void MapPoints::on_message(std::span<const uint8_t> bytes) {
  const auto message = decode<map_delta_t>(bytes);
  MapDelta delta;
  if (!append(message, &delta)) return;
  if (message.header.is_snapshot != 0 && message.header.part == 0) {
    points_.clear();
    keyframes_.clear();
  }
  for (const PointId id : delta.points_removed) points_.erase(id);
  for (const MapPoint& p : delta.points_set) points_[p.id] = p.position_in_map.cast<double>();
  for (const MapKeyframe& k : delta.keyframes_set) keyframes_.insert(k.id);
  for (const KeyframeId id : delta.keyframes_removed) keyframes_.erase(id);
}

std::vector<Eigen::Vector3d> MapPoints::positions_in_map() const {
  std::vector<Eigen::Vector3d> positions;
  positions.reserve(points_.size());
  for (const auto& [id, position] : points_) positions.push_back(position);
  return positions;
}

}  // namespace foresight
