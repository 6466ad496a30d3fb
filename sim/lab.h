// A furnished robot lab made by code from a seed: same seed, same lab, down to the last texel.
//
//   const Scene lab = make_lab(1);
//   const Scene other = make_lab({.seed = 2, .letters = " ABCD ", .panel_places = {1, 4}});
//   other.targets[0].world_from_face;  // of card A
//
// World is the arm's base frame: x towards the desk, y left, z up, origin at the arm's shoulder,
// 1.02 m above the floor. The desk stands in front of the arm (x 0.75 … 1.65 m) with objects on it;
// behind it a brick wall with shelf, whiteboard and posters; the other walls are nearly plain.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <string>

#include "sim/scene.h"

namespace foresight::sim {

constexpr float kFloor_m = -1.02f;
constexpr float kCeiling_m = 1.78f;
constexpr float kFrontWall_m = 1.95f;
constexpr float kBackWall_m = -3.2f;
constexpr float kLeftWall_m = 2.7f;
constexpr float kRightWall_m = -2.9f;
constexpr float kDeskTop_m = -0.30f;

constexpr int kLetterPlaces = 6;
constexpr int kPanelPlaces = 5;

/// What stands where in an experiment. Places of cards: 0, 1, 2, 3 from left to right in the desk's
/// middle row, 4 at its far left, 5 on the cartons left of it. Places of panels: 0 in the middle of
/// the desk, 1 on the carton at its back, 2 before the monitor, 3 at its right end, 4 at its near
/// left corner. They vary by a centimetre or two with the seed.
struct LabOptions {
  uint64_t seed = 1;
  /// The card at each of the kLetterPlaces, A … F; a space leaves the place empty.
  std::string letters = "DABCEF";
  /// Where the two LED panels stand.
  std::array<int, 2> panel_places = {0, 3};
  /// The LEDs of each panel that are lit at first, in rows from the upper left.
  std::array<std::bitset<9>, 2> leds_lit = {0b111'101'111, 0b111'111'111};
};

/// Builds, paints and lights the lab; about 1 s. Throws ConfigError for places and letters that do
/// not exist or are used twice. Scene::targets has the cards in alphabetical order, led_panels both
/// panels.
Scene make_lab(const LabOptions& options);
Scene make_lab(uint64_t seed);

}  // namespace foresight::sim
