// The points of slam's map as MAP_DELTA tells them, for whoever only watches.
#pragma once

#include <map>
#include <set>
#include <span>
#include <vector>

#include "common/map_delta.h"

namespace foresight {

class MapPoints {
 public:
  /// A message on MAP_DELTA; wrong ones are ignored.
  void on_message(std::span<const uint8_t> bytes);
  std::vector<Eigen::Vector3d> positions_in_map() const;
  int points() const { return static_cast<int>(points_.size()); }
  int keyframes() const { return static_cast<int>(keyframes_.size()); }

 private:
  std::map<PointId, Eigen::Vector3d> points_;
  std::set<KeyframeId> keyframes_;
};

}  // namespace foresight
