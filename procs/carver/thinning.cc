#include "procs/carver/thinning.h"

#include <algorithm>

namespace foresight::carving {
namespace {

std::vector<KeyframeIndex> keyframes_by_age(const MapState& map) {
  std::vector<KeyframeIndex> order;
  for (const KeyframeIndex keyframe : map.keyframes.ids()) {
    if (map.keyframes[keyframe].alive) order.push_back(keyframe);
  }
  std::sort(order.begin(), order.end(), [&](KeyframeIndex a, KeyframeIndex b) {
    return map.keyframes[a].arrival < map.keyframes[b].arrival;
  });
  return order;
}

bool is_listed(const MapState& map, ConstraintIndex constraint) {
  const ConstraintState state = map.constraints[constraint].state;
  return state == ConstraintState::kTraced || state == ConstraintState::kNew;
}

int64_t listed_constraints(const MapState& map, PointIndex point) {
  const auto& constraints = map.points[point].constraints;
  return std::count_if(constraints.begin(), constraints.end(),
                       [&](ConstraintIndex constraint) { return is_listed(map, constraint); });
}

}  // namespace

int64_t thin_oldest(MapState& map, int64_t count) {
  int64_t thinned = 0;
  const std::vector<KeyframeIndex> order = keyframes_by_age(map);
  for (const int64_t kept : {4, 2, 1}) {
    for (const KeyframeIndex keyframe : order) {
      const std::vector<ConstraintIndex> constraints = map.keyframes[keyframe].constraints;
      for (const ConstraintIndex constraint : constraints) {
        if (thinned == count) return thinned;
        const PointIndex point = map.constraints[constraint].point;
        if (listed_constraints(map, point) <= kept) continue;
        map.thin_constraint(constraint);
        ++thinned;
      }
    }
  }
  return thinned;
}

}  // namespace foresight::carving
