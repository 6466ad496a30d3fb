#include "sim/lab.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "common/errors.h"
#include "sim/furniture.h"
#include "sim/lighting.h"

namespace foresight::sim {
namespace {

using Eigen::Vector3f;

constexpr float kHalfTurn = 3.14159265f;

// The room's shell: walls face inwards, tiled in metres.
void build_room(Scene& scene, const Palette& palette) {
  const float f = kFrontWall_m, b = kBackWall_m, l = kLeftWall_m, r = kRightWall_m;
  const float top = kCeiling_m, low = kFloor_m;
  add_quad(scene, "wall.front", {{{f, l, top}, {f, r, top}, {f, r, low}, {f, l, low}}},
           {palette.brick, 1.0f, 0, 0.035f});
  add_quad(scene, "wall.back", {{{b, r, top}, {b, l, top}, {b, l, low}, {b, r, low}}},
           {palette.plaster, 1.5f, 0, 0.12f});
  add_quad(scene, "wall.left", {{{b, l, top}, {f, l, top}, {f, l, low}, {b, l, low}}},
           {palette.plaster, 1.5f, 0, 0.07f});
  add_quad(scene, "wall.right", {{{f, r, top}, {b, r, top}, {b, r, low}, {f, r, low}}},
           {palette.plaster, 1.5f, 0, 0.07f});
  add_quad(scene, "floor", {{{f, l, low}, {f, r, low}, {b, r, low}, {b, l, low}}},
           {palette.floor, 1.2f, 0, 0.06f});
  add_quad(scene, "ceiling", {{{b, l, top}, {b, r, top}, {f, r, top}, {f, l, top}}},
           {palette.ceiling, 0.6f, 0, 0.2f});
}

// A lamp under the ceiling, left edge at y, and the light it gives.
void add_ceiling_lamp(Scene& scene, const Palette& palette, float x_m, float y_m,
                      const Vector3f& radiance) {
  const Vector3f corner(x_m, y_m, kCeiling_m - 0.02f);
  const Vector3f along(1.2f, 0, 0), across(0, 0.35f, 0);
  add_quad(scene, "ceiling_lamp",
           {corner + across, corner, corner + along, corner + along + across},
           {palette.white, 0, 1.4f, 0.2f});
  scene.lamps.push_back({corner, across, along, radiance});
}

// The lamp on the left is near the desk and gives the shadows; the one on the right and the window
// fill them.
void build_lamps(Scene& scene, const Palette& palette) {
  add_ceiling_lamp(scene, palette, 0.0f, 0.75f, {7.6f, 7.2f, 6.5f});
  add_ceiling_lamp(scene, palette, -1.0f, -1.3f, {3.4f, 3.25f, 3.0f});
  const float y = kLeftWall_m - 0.01f;
  add_quad(scene, "window", {{{-2.2f, y, 1.3f}, {-0.6f, y, 1.3f}, {-0.6f, y, 0}, {-2.2f, y, 0}}},
           {palette.landscapes[0], 0, 1.5f, 0.2f});
  scene.lamps.push_back({{-2.2f, y, 0}, {1.6f, 0, 0}, {0, 0, 1.3f}, {2.3f, 2.6f, 3.1f}});
}

struct Hanging {
  const char* name;
  float left_m, top_m, width_m, height_m;  // y of the left edge, z of the upper edge
  int texture;
};

void hang(Scene& scene, const Palette& palette, const Hanging& h) {
  constexpr float kThickness_m = 0.015f;
  BoxFinish finish = all_sides({palette.dark_metal, 0.3f, 0, 0.03f});
  finish.front = {h.texture, 0, 0, 0.025f};
  add_box(scene, h.name,
          at(kFrontWall_m - kThickness_m / 2, h.left_m - h.width_m / 2, h.top_m - h.height_m),
          {kThickness_m, h.width_m, h.height_m}, finish);
}

void decorate_walls(Scene& scene, const Palette& p) {
  for (const Hanging& h : {Hanging{"whiteboard", 0.12f, 1.0f, 1.1f, 0.68f, p.whiteboard},
                           {"notes", -0.30f, 0.28f, 0.42f, 0.28f, p.notes},
                           {"poster", 1.78f, 0.86f, 0.62f, 0.84f, p.posters[0]},
                           {"poster", -1.05f, 0.62f, 0.46f, 0.64f, p.posters[1]},
                           {"picture", 1.02f, 0.24f, 0.36f, 0.27f, p.landscapes[1]},
                           {"page", 0.28f, 0.24f, 0.21f, 0.297f, p.pages[1]},
                           {"page", 0.56f, 0.21f, 0.21f, 0.297f, p.pages[3]},
                           {"picture", 2.5f, 0.7f, 0.5f, 0.38f, p.abstracts[0]}}) {
    hang(scene, p, h);
  }
  // One picture each on the plain side walls.
  const float right = kRightWall_m + 0.01f, left = kLeftWall_m - 0.01f;
  add_quad(scene, "picture",
           {{{1.2f, right, 0.7f}, {0.4f, right, 0.7f}, {0.4f, right, 0.1f}, {1.2f, right, 0.1f}}},
           {p.landscapes[2], 0, 0, 0.05f});
  add_quad(scene, "poster",
           {{{0.3f, left, 0.9f}, {0.9f, left, 0.9f}, {0.9f, left, 0.05f}, {0.3f, left, 0.05f}}},
           {p.posters[1], 0, 0, 0.05f});
}

// Skirting boards, and at the back a door, a bench with things on it and a notice board.
void furnish_back(Scene& scene, Furnisher& things, const Palette& p) {
  constexpr float kHeight_m = 0.08f, kThick_m = 0.012f;
  const Finish white{p.grey_plastic, 0.3f, 0, 0.15f};
  const float middle = (kLeftWall_m + kRightWall_m) / 2, width = kLeftWall_m - kRightWall_m;
  const float depth = kFrontWall_m - kBackWall_m, centre = (kFrontWall_m + kBackWall_m) / 2;
  for (const float x : {kBackWall_m + kThick_m / 2, kFrontWall_m - kThick_m / 2}) {
    add_box(scene, "skirting", at(x, middle, kFloor_m), {kThick_m, width, kHeight_m},
            all_sides(white));
  }
  for (const float y : {kRightWall_m + kThick_m / 2, kLeftWall_m - kThick_m / 2}) {
    add_box(scene, "skirting", at(centre, y, kFloor_m), {depth, kThick_m, kHeight_m},
            all_sides(white));
  }
  const Frame door = at(kBackWall_m + 0.025f, 1.5f, kFloor_m, kHalfTurn);
  add_box(scene, "door.frame", door, {0.03f, 1.06f, 2.1f}, all_sides(white));
  add_box(scene, "door", door, {0.05f, 0.9f, 2.02f}, all_sides({p.shelf_wood, 0.9f, 0, 0.1f}));
  add_box(scene, "door.handle", door * at(-0.04f, -0.38f, 1.0f), {0.03f, 0.13f, 0.02f},
          all_sides({p.dark_metal, 0.2f}));
  const Frame bench = at(kBackWall_m + 0.4f, -1.1f, kFloor_m, kHalfTurn);
  things.desk("bench", bench, {0.6f, 1.7f, 0.74f});
  things.carton(bench * at(0.05f, 0.55f, 0.74f, 0.1f), {0.35f, 0.4f, 0.3f});
  things.book_row(bench * at(0.1f, -0.1f, 0.74f), 0.5f, 0.27f);
  things.plant(bench * at(0, -0.6f, 0.74f), 0.4f);
  const auto hang_back = [&](float left, float top, float wide, float high, int texture) {
    const float x = kBackWall_m + 0.012f;
    add_quad(scene, "picture",
             {{{x, left, top},
               {x, left + wide, top},
               {x, left + wide, top - high},
               {x, left, top - high}}},
             {texture, 0, 0, 0.08f});
  };
  hang_back(-1.75f, 0.95f, 0.62f, 0.84f, p.posters[1]);
  hang_back(-0.95f, 0.8f, 0.8f, 0.55f, p.notes);
  hang_back(0.15f, 0.75f, 0.55f, 0.42f, p.abstracts[2]);
}

// The desk's objects in three rows; places and turns vary with the seed.
void furnish_desk(Furnisher& things, const Palette& p, const std::string& letters, Random& random) {
  const auto spot = [&random](float x, float y, double turn = 0.15) {
    return at(x + static_cast<float>(random.uniform(-0.02, 0.02)),
              y + static_cast<float>(random.uniform(-0.025, 0.025)), kDeskTop_m,
              static_cast<float>(random.uniform(-turn, turn)));
  };
  const auto card = [&](const Frame& frame, size_t place) {
    if (letters[place] != ' ') things.letter_card(frame, static_cast<size_t>(letters[place] - 'A'));
  };
  things.plant(spot(1.48f, 0.93f), 0.32f);
  things.carton(spot(1.46f, 0.62f), {0.24f, 0.3f, 0.2f});
  things.book_row(spot(1.48f, 0.28f, 0.05), 0.26f, 0.25f);
  things.monitor(spot(1.42f, -0.24f, 0.2));
  things.lamp(spot(1.5f, -0.68f, 0.6));
  things.book_stack(spot(1.42f, -0.92f), 5);

  things.picture_box(spot(1.25f, 0.80f, 0.4), {0.06f, 0.15f, 0.2f}, p.landscapes[2]);
  card(spot(1.15f, 0.62f), 0);
  things.can(spot(1.24f, 0.45f));
  card(spot(1.2f, 0.28f), 1);
  card(spot(1.14f, -0.56f), 2);
  things.mug(spot(1.2f, -0.7f, 1.0));
  card(spot(1.16f, -0.84f), 3);
  things.picture_box(spot(1.32f, 0.1f, 0.3), {0.1f, 0.1f, 0.1f}, p.abstracts[1]);
  card(spot(1.32f, 0.98f), 4);

  things.sheet("checkerboard", spot(0.98f, 0.78f, 0.5), 0.19f, 0.26f, p.checkerboard);
  things.sheet("page", spot(0.96f, 0.42f, 0.3), 0.297f, 0.21f, p.pages[0]);
  things.mug(spot(0.98f, 0.2f, 1.0));
  things.keyboard(spot(1.02f, -0.2f, 0.1));
  things.sheet("page", spot(0.95f, -0.6f, 0.5), 0.297f, 0.21f, p.pages[2]);
  things.sheet("book_cover", spot(0.97f, -0.9f, 0.5), 0.24f, 0.18f, p.covers[0]);
}

void furnish_room(Furnisher& things, const Palette& p, const std::string& letters, Random& random) {
  const auto turn = [&random] { return static_cast<float>(random.uniform(-0.2, 0.2)); };
  things.desk("desk", at(1.2f, 0, kFloor_m), {0.9f, 2.2f, kDeskTop_m - kFloor_m});
  things.shelf_unit(at(1.78f, -2.15f, kFloor_m), {0.3f, 1.1f, 1.9f}, 6);
  things.wall_shelf(at(1.84f, 0.68f, 0.34f), 0.2f, 0.9f);
  things.chair(at(0.95f, -1.55f, kFloor_m, 0.5f + turn()));
  things.carton(at(1.5f, 1.75f, kFloor_m, turn()), {0.5f, 0.55f, 0.42f});
  things.carton(at(1.55f, 1.7f, kFloor_m + 0.42f, turn()), {0.4f, 0.42f, 0.32f});
  things.carton(at(1.5f, 2.3f, kFloor_m, turn()), {0.4f, 0.45f, 0.36f});
  things.plant(at(1.5f, 2.3f, kFloor_m + 0.36f), 0.6f);
  if (letters[5] != ' ') {
    things.letter_card(at(1.45f, 1.66f, kFloor_m + 0.74f, 0.4f),
                       static_cast<size_t>(letters[5] - 'A'));
  }
  things.picture_box(at(1.0f, 0.75f, kFloor_m), {0.5f, 0.4f, 0.5f}, p.shelf_wood);
}

// Both panels face the arm, more or less.
void place_panels(Furnisher& things, const LabOptions& options) {
  constexpr float kOnCarton_m = kDeskTop_m + 0.2f;
  constexpr std::array<std::array<float, 3>, kPanelPlaces> kPlaces = {{{1.17f, 0.12f, kDeskTop_m},
                                                                       {1.40f, 0.62f, kOnCarton_m},
                                                                       {1.20f, -0.40f, kDeskTop_m},
                                                                       {1.12f, -1.02f, kDeskTop_m},
                                                                       {0.92f, 1.00f, kDeskTop_m}}};
  Random random(options.seed, "panels");
  std::array<Frame, kPanelPlaces> frames;
  for (size_t i = 0; i < frames.size(); ++i) {
    const auto& [x, y, z] = kPlaces[i];
    const auto vary = [&random](double by) { return static_cast<float>(random.uniform(-by, by)); };
    frames[i] = at(x + vary(0.01), y + vary(0.01), z, std::atan2(y, x) + vary(0.2));
  }
  for (size_t i = 0; i < options.panel_places.size(); ++i) {
    things.led_panel(frames[static_cast<size_t>(options.panel_places[i])], options.leds_lit[i]);
  }
}

void check(const LabOptions& options) {
  const std::string& letters = options.letters;
  std::set<char> seen;
  const bool good_letters = std::all_of(letters.begin(), letters.end(), [&seen](char c) {
    return c == ' ' || (c >= 'A' && c <= 'F' && seen.insert(c).second);
  });
  if (letters.size() != kLetterPlaces || !good_letters) {
    throw ConfigError("lab: letters is '" + letters + "' but must have " +
                      std::to_string(kLetterPlaces) +
                      " characters, A to F (each once at most) or a space");
  }
  const auto [first, second] = options.panel_places;
  for (const int place : options.panel_places) {
    if (place < 0 || place >= kPanelPlaces || first == second) {
      throw ConfigError("lab: panel_places is " + std::to_string(first) + ", " +
                        std::to_string(second) + " but must be two of 0 to " +
                        std::to_string(kPanelPlaces - 1));
    }
  }
}

}  // namespace

Scene make_lab(const LabOptions& options) {
  check(options);
  Scene scene;
  const Palette palette = paint_palette(options.seed, scene);
  Random random(options.seed, "places");
  Furnisher things(scene, palette, options.seed);
  build_room(scene, palette);
  build_lamps(scene, palette);
  decorate_walls(scene, palette);
  furnish_room(things, palette, options.letters, random);
  furnish_desk(things, palette, options.letters, random);
  place_panels(things, options);
  furnish_back(scene, things, palette);
  std::sort(scene.targets.begin(), scene.targets.end(),
            [](const Target& a, const Target& b) { return a.name < b.name; });
  bake_lighting(scene);
  return scene;
}

Scene make_lab(uint64_t seed) {
  LabOptions options;
  options.seed = seed;
  return make_lab(options);
}

}  // namespace foresight::sim
