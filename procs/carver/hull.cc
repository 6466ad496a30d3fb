#include "procs/carver/hull.h"

#include <algorithm>
#include <cmath>

namespace foresight::carving {

constexpr double kLeastFactor = 1.5;  // all points must lie strictly inside
constexpr double kInside = 1.01;      // also after the corners were rounded
// Corners are floats: keep the cube much larger than a float's step at this distance.
constexpr double kLeastPerMagnitude = 1e-3;

void Extent::add(const Point3& point) {
  for (size_t i = 0; i < 3; ++i) {
    low[i] = empty ? point[i] : std::min(low[i], point[i]);
    high[i] = empty ? point[i] : std::max(high[i], point[i]);
  }
  empty = false;
}

bool Hull::holds(const Point3& point) const {
  for (size_t i = 0; i < 3; ++i) {
    if (!(std::abs(point[i] - centre[i]) < limit)) return false;
  }
  return true;
}

std::array<Point3, 8> Hull::corners() const {
  std::array<Point3, 8> result{};
  for (size_t n = 0; n < 8; ++n) {
    for (size_t i = 0; i < 3; ++i) {
      const double sign = (n >> i & 1) != 0 ? 1.0 : -1.0;
      result[n][i] = static_cast<double>(static_cast<float>(centre[i] + sign * half_size));
    }
  }
  return result;
}

std::optional<Hull> fit_hull(const Extent& extent, const CarverOptions& options) {
  if (extent.empty) return std::nullopt;
  if (options.hull_half_size_mu > 0.0) {
    const auto half_size = static_cast<double>(static_cast<float>(options.hull_half_size_mu));
    const Hull fixed{{}, half_size, half_size};
    if (fixed.holds(extent.low) && fixed.holds(extent.high)) return fixed;
  }
  Hull hull;
  double half_extent = 0.0;
  double magnitude = 0.0;
  for (size_t i = 0; i < 3; ++i) {
    hull.centre[i] = 0.5 * (extent.low[i] + extent.high[i]);
    half_extent = std::max(half_extent, 0.5 * (extent.high[i] - extent.low[i]));
    magnitude = std::max({magnitude, std::abs(extent.low[i]), std::abs(extent.high[i])});
  }
  if (half_extent == 0.0) return std::nullopt;
  const double factor = std::max(kLeastFactor, options.hull_extent_factor);
  hull.half_size = std::max(factor * half_extent, kLeastPerMagnitude * magnitude);
  hull.limit = std::clamp(options.hull_use_limit * hull.half_size, kInside * half_extent,
                          hull.half_size / kInside);
  return hull;
}

Hull moved_hull(const Hull& hull, const Point3& centre) {
  Hull moved{centre, hull.half_size, hull.limit};
  for (const double x : centre) {
    moved.half_size = std::max(moved.half_size, kLeastPerMagnitude * std::abs(x));
  }
  moved.limit = std::min(moved.limit, moved.half_size / kInside);
  return moved;
}

}  // namespace foresight::carving
