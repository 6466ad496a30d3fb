// Where the points and cameras of a random map lie: anywhere, and in the places that break
// geometry.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <random>

namespace foresight::carver_test {

enum class Layout : uint8_t {
  kGeneral,    // anywhere
  kLattice,    // small whole numbers; cameras there too, on edges, facets and vertices
  kPlane,      // points on one plane, some cameras on it
  kNearPlane,  // as kPlane, but for the last bits
  kLine,       // points on one line, some cameras on it
  kClusters,   // nine places, most of them shared by many points
  kSphere,     // points on one sphere, exactly: any five of them are cospherical
  kOutliers,   // one point in eight is 10 to 10 000 times as far away
  kAtPoints,   // cameras where points may be
};
inline constexpr std::array kAllLayouts{Layout::kGeneral,   Layout::kLattice,  Layout::kPlane,
                                        Layout::kNearPlane, Layout::kLine,     Layout::kClusters,
                                        Layout::kSphere,    Layout::kOutliers, Layout::kAtPoints};

enum class Placed : uint8_t { kPoint, kCamera };

/// A random place of the layout, some units across.
Eigen::Vector3d place_in(Layout layout, Placed what, std::mt19937& random);

}  // namespace foresight::carver_test
