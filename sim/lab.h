// A furnished robot lab made by code from a seed: same seed, same lab, down to the last texel.
//
//   const Scene lab = make_lab(1);
//
// World is the arm's base frame: x towards the desk, y left, z up, origin at the arm's shoulder,
// 1.02 m above the floor. The desk stands in front of the arm (x 0.75 … 1.65 m) with objects on it;
// behind it a brick wall with shelf, whiteboard and posters; the other walls are nearly plain.
#pragma once

#include <cstdint>

#include "sim/scene.h"

namespace foresight::sim {

constexpr float kFloor_m = -1.02f;
constexpr float kCeiling_m = 1.78f;
constexpr float kFrontWall_m = 1.95f;
constexpr float kBackWall_m = -3.2f;
constexpr float kLeftWall_m = 2.7f;
constexpr float kRightWall_m = -2.9f;
constexpr float kDeskTop_m = -0.30f;

/// Builds, paints and lights the lab; about 1 s.
Scene make_lab(uint64_t seed);

}  // namespace foresight::sim
