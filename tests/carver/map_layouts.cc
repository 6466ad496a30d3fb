#include "tests/carver/map_layouts.h"

#include <algorithm>
#include <cmath>

#include "tests/carver/random_numbers.h"

namespace foresight::carver_test {
namespace {

using Eigen::Vector3d;

Vector3d in_box(std::mt19937& random) {
  const double x = real(random, -1, 1), y = real(random, -1, 1), z = real(random, -1, 1);
  return {x, y, z};
}

Vector3d on_lattice(Placed what, std::mt19937& random) {
  const int x = below(random, 4), y = below(random, 4), z = below(random, 4);
  Vector3d p(x, y, z);
  if (what == Placed::kCamera && below(random, 2) == 0) {
    const int i = below(random, 2), j = below(random, 2), k = below(random, 2);
    p += 0.5 * Vector3d(i, j, k);
  }
  return p;
}

Vector3d on_plane(Placed what, std::mt19937& random) {
  const int whole = below(random, 5), quarters = below(random, 4), y = below(random, 5);
  Vector3d p(whole + 0.25 * quarters, y, 0.0);
  if (what == Placed::kCamera && below(random, 3) > 0) p.z() = below(random, 3) + 1.0;
  return p;
}

Vector3d near_plane(Placed what, std::mt19937& random) {
  Vector3d p = on_plane(what, random);
  for (int i = 0; i < 3; ++i) p[i] += (below(random, 5) - 2) * 0x1p-22;
  return p;
}

Vector3d on_line(Placed what, std::mt19937& random) {
  const Vector3d along = 0.25 * below(random, 40) * Vector3d(1, 2, -1);
  return what == Placed::kPoint || below(random, 3) == 0 ? along : along + in_box(random);
}

Vector3d in_cluster(Placed what, std::mt19937& random) {
  const int n = below(random, 9);
  const Vector3d centre(n % 3, n / 3, (n * n) % 4);
  return what == Placed::kPoint ? centre : centre + 0.5 * in_box(random);
}

// Whole numbers whose squares add up to 81, in any order and with any sign.
Vector3d on_sphere(Placed what, std::mt19937& random) {
  if (what == Placed::kCamera && below(random, 2) == 0) return 5 * in_box(random);
  constexpr std::array<std::array<int, 3>, 4> kShapes{{{1, 4, 8}, {4, 4, 7}, {3, 6, 6}, {0, 0, 9}}};
  std::array<int, 3> n = kShapes[static_cast<size_t>(below(random, 4))];
  std::swap(n[0], n[static_cast<size_t>(below(random, 3))]);
  std::swap(n[1], n[static_cast<size_t>(1 + below(random, 2))]);
  Vector3d p;
  for (int i = 0; i < 3; ++i) p[i] = n[static_cast<size_t>(i)] * (below(random, 2) == 0 ? 1 : -1);
  return p;
}

Vector3d with_outliers(Placed what, std::mt19937& random) {
  const Vector3d p = in_box(random);
  const bool is_outlier = what == Placed::kPoint && below(random, 8) == 0;
  return is_outlier ? std::pow(10.0, real(random, 1, 4)) * p : p;
}

// Few places anywhere, so that cameras and points meet there.
Vector3d at_points(std::mt19937& random) {
  std::mt19937 places(static_cast<uint32_t>(below(random, 24)));
  return in_box(places).cast<float>().cast<double>();
}

}  // namespace

Eigen::Vector3d place_in(Layout layout, Placed what, std::mt19937& random) {
  switch (layout) {
    case Layout::kGeneral:
      return in_box(random);
    case Layout::kLattice:
      return on_lattice(what, random);
    case Layout::kPlane:
      return on_plane(what, random);
    case Layout::kNearPlane:
      return near_plane(what, random);
    case Layout::kLine:
      return on_line(what, random);
    case Layout::kClusters:
      return in_cluster(what, random);
    case Layout::kSphere:
      return on_sphere(what, random);
    case Layout::kOutliers:
      return with_outliers(what, random);
    case Layout::kAtPoints:
      return at_points(random);
  }
  return in_box(random);
}

}  // namespace foresight::carver_test
