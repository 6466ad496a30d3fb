// The bounding cube of the triangulation: 8 corners far outside the scene.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "procs/carver/carver.h"
#include "procs/carver/tetrahedra.h"

namespace foresight::carving {

/// Axis-aligned extent of what the map contains.
struct Extent {
  Point3 low{}, high{};
  bool empty = true;
  void add(const Point3& point);
};

struct Hull {
  Point3 centre{};
  double half_size = 0.0;  // map units; 0 = none yet
  double limit = 0.0;      // points and cameras stay within ± this of the centre

  bool holds(const Point3& point) const;
  /// Corner n: + where bit 0, 1, 2 (x, y, z) of n is set; exactly representable as float.
  std::array<Point3, 8> corners() const;
};

/// The cube for a map of this extent; none while the extent is a single point.
std::optional<Hull> fit_hull(const Extent& extent, const CarverOptions& options);
/// The cube around another place, larger where floats are too coarse for it.
Hull moved_hull(const Hull& hull, const Point3& centre);

}  // namespace foresight::carving
