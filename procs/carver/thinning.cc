#include "procs/carver/thinning.h"

#include <algorithm>

namespace foresight::carving {
namespace {

std::vector<int32_t> keyframes_by_age(const MapState& map) {
  std::vector<int32_t> order;
  for (size_t n = 0; n < map.keyframes.size(); ++n) {
    if (map.keyframes[n].alive) order.push_back(static_cast<int32_t>(n));
  }
  const auto arrival = [&](int32_t n) { return map.keyframes[static_cast<size_t>(n)].arrival; };
  std::sort(order.begin(), order.end(),
            [&](int32_t a, int32_t b) { return arrival(a) < arrival(b); });
  return order;
}

bool is_listed(const MapState& map, int32_t ray) {
  const RayState state = map.rays[static_cast<size_t>(ray)].state;
  return state == RayState::kTraced || state == RayState::kNew;
}

int64_t listed_rays(const MapState& map, int32_t point) {
  const auto& rays = map.points[static_cast<size_t>(point)].rays;
  return std::count_if(rays.begin(), rays.end(), [&](int32_t ray) { return is_listed(map, ray); });
}

}  // namespace

int64_t thin_oldest(MapState& map, int64_t count) {
  int64_t thinned = 0;
  const std::vector<int32_t> order = keyframes_by_age(map);
  for (const int64_t kept : {4, 2, 1}) {
    for (const int32_t keyframe : order) {
      const std::vector<int32_t> rays = map.keyframes[static_cast<size_t>(keyframe)].rays;
      for (const int32_t ray : rays) {
        if (thinned == count) return thinned;
        const int32_t point = map.rays[static_cast<size_t>(ray)].point;
        if (listed_rays(map, point) <= kept) continue;
        map.thin_ray(ray);
        ++thinned;
      }
    }
  }
  return thinned;
}

}  // namespace foresight::carving
