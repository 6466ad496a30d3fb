#include "sim/lab.h"

#include "sim/furniture.h"
#include "sim/lighting.h"

namespace foresight::sim {
namespace {

using Eigen::Vector3f;

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
           {palette.white, 0, 1.4f});
  scene.lamps.push_back({corner, across, along, radiance});
}

// The lamp on the left is near the desk and gives the shadows; the one on the right and the window
// fill them.
void build_lamps(Scene& scene, const Palette& palette) {
  add_ceiling_lamp(scene, palette, 0.0f, 0.75f, {7.6f, 7.2f, 6.5f});
  add_ceiling_lamp(scene, palette, -1.0f, -1.3f, {3.4f, 3.25f, 3.0f});
  const float y = kLeftWall_m - 0.01f;
  add_quad(scene, "window", {{{-2.2f, y, 1.3f}, {-0.6f, y, 1.3f}, {-0.6f, y, 0}, {-2.2f, y, 0}}},
           {palette.landscapes[0], 0, 1.5f});
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

// The desk's objects in three rows; places and turns vary with the seed.
void furnish_desk(Furnisher& things, const Palette& p, Random& random) {
  const auto spot = [&random](float x, float y, double turn = 0.15) {
    return at(x + static_cast<float>(random.uniform(-0.02, 0.02)),
              y + static_cast<float>(random.uniform(-0.025, 0.025)), kDeskTop_m,
              static_cast<float>(random.uniform(-turn, turn)));
  };
  things.plant(spot(1.48f, 0.93f), 0.32f);
  things.carton(spot(1.46f, 0.62f), {0.24f, 0.3f, 0.2f});
  things.book_row(spot(1.48f, 0.28f, 0.05), 0.26f, 0.25f);
  things.monitor(spot(1.42f, -0.24f, 0.2));
  things.lamp(spot(1.5f, -0.68f, 0.6));
  things.book_stack(spot(1.42f, -0.92f), 5);

  things.picture_box(spot(1.25f, 0.80f, 0.4), {0.06f, 0.15f, 0.2f}, p.landscapes[2]);
  things.letter_card(spot(1.15f, 0.62f), 3);
  things.can(spot(1.24f, 0.45f));
  things.letter_card(spot(1.2f, 0.28f), 0);
  things.led_panel(spot(1.17f, 0.12f));
  things.letter_card(spot(1.14f, -0.56f), 1);
  things.mug(spot(1.2f, -0.7f, 1.0));
  things.letter_card(spot(1.16f, -0.84f), 2);
  things.picture_box(spot(1.32f, 0.1f, 0.3), {0.1f, 0.1f, 0.1f}, p.abstracts[1]);
  things.letter_card(spot(1.32f, 0.98f), 4);

  things.sheet("checkerboard", spot(0.98f, 0.78f, 0.5), 0.19f, 0.26f, p.checkerboard);
  things.sheet("page", spot(0.96f, 0.42f, 0.3), 0.297f, 0.21f, p.pages[0]);
  things.mug(spot(0.98f, 0.2f, 1.0));
  things.keyboard(spot(1.02f, -0.2f, 0.1));
  things.sheet("page", spot(0.95f, -0.6f, 0.5), 0.297f, 0.21f, p.pages[2]);
  things.sheet("book_cover", spot(0.97f, -0.9f, 0.5), 0.24f, 0.18f, p.covers[0]);
}

void furnish_room(Furnisher& things, const Palette& p, Random& random) {
  const auto turn = [&random] { return static_cast<float>(random.uniform(-0.2, 0.2)); };
  things.desk(at(1.2f, 0, kFloor_m), {0.9f, 2.2f, kDeskTop_m - kFloor_m});
  things.shelf_unit(at(1.78f, -2.15f, kFloor_m), {0.3f, 1.1f, 1.9f}, 6);
  things.wall_shelf(at(1.84f, 0.68f, 0.34f), 0.2f, 0.9f);
  things.chair(at(0.95f, -1.55f, kFloor_m, 0.5f + turn()));
  things.carton(at(1.5f, 1.75f, kFloor_m, turn()), {0.5f, 0.55f, 0.42f});
  things.carton(at(1.55f, 1.7f, kFloor_m + 0.42f, turn()), {0.4f, 0.42f, 0.32f});
  things.carton(at(1.5f, 2.3f, kFloor_m, turn()), {0.4f, 0.45f, 0.36f});
  things.plant(at(1.5f, 2.3f, kFloor_m + 0.36f), 0.6f);
  things.letter_card(at(1.45f, 1.66f, kFloor_m + 0.74f, 0.4f), 5);
  things.picture_box(at(1.0f, 0.75f, kFloor_m), {0.5f, 0.4f, 0.5f}, p.shelf_wood);
}

}  // namespace

Scene make_lab(uint64_t seed) {
  Scene scene;
  const Palette palette = paint_palette(seed, scene);
  Random random(seed, "places");
  Furnisher things(scene, palette, seed);
  build_room(scene, palette);
  build_lamps(scene, palette);
  decorate_walls(scene, palette);
  furnish_room(things, palette, random);
  furnish_desk(things, palette, random);
  bake_lighting(scene);
  return scene;
}

}  // namespace foresight::sim
