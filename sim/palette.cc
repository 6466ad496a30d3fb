#include "sim/furniture.h"
#include "sim/textures.h"

namespace foresight::sim {
namespace {

void paint_materials(uint64_t seed, Scene& scene, Palette& p) {
  const auto add = [&](const cv::Mat& image, bool tiled) {
    return scene.add_texture(make_texture(image, tiled));
  };
  Random random(seed, "materials");
  const Rgb plasters[] = {{206, 200, 186}, {196, 204, 206}, {208, 196, 178}};
  const Rgb bricks[] = {{164, 112, 92}, {172, 140, 122}, {150, 104, 88}};
  p.white = add(paint_plaster(64, {236, 236, 234}, 1, random), true);
  p.desk_wood = add(paint_wood(2048, 1024, {}, random), false);
  p.shelf_wood = add(paint_wood(512, 512, {{186, 150, 106}, {136, 98, 62}, 1}, random), true);
  p.floor = add(paint_wood(1024, 1024, {{150, 112, 78}, {96, 68, 46}, 8}, random), true);
  p.dark_metal = add(paint_plaster(128, {72, 74, 78}, 8, random), true);
  p.dark_plastic = add(paint_plaster(128, {44, 45, 48}, 5, random), true);
  p.grey_plastic = add(paint_plaster(128, {172, 173, 172}, 5, random), true);
  p.brick = add(paint_brick(1024, 1024, {bricks[random.below(3)]}, random), true);
  p.plaster = add(paint_plaster(512, plasters[random.below(3)], 5, random), true);
  p.ceiling = add(paint_ceiling(256, random), true);
  p.fabric = add(paint_fabric(256, random_colour(random), random), true);
  p.clay = add(paint_flecks(256, {168, 96, 66}, 16, 300, random), true);
  p.cardboard = add(paint_cardboard(false, random), false);
  p.cardboard_printed = add(paint_cardboard(true, random), false);
}

void paint_prints(uint64_t seed, Scene& scene, Palette& p) {
  const auto add = [&](const cv::Mat& image) {
    return scene.add_texture(make_texture(image, false));
  };
  Random random(seed, "prints");
  p.page_edges = add(paint_page_edges(random));
  p.checkerboard = add(paint_checkerboard(9, 6));
  p.screen = add(paint_screen(random));
  p.keyboard = add(paint_keyboard(random));
  p.whiteboard = add(paint_whiteboard(1024, 640, random));
  p.notes = add(paint_notes(random));
  for (int i = 0; i < 4; ++i) p.pages.push_back(add(paint_page(512, 724, 1 + i % 2, random)));
  for (char c = 'A'; c <= 'F'; ++c) p.letters.push_back(add(paint_letter_card(c, random)));
  for (int i = 0; i < 2; ++i) p.posters.push_back(add(paint_poster(768, 1024, random)));
  for (int i = 0; i < 3; ++i) p.landscapes.push_back(add(paint_landscape(512, 384, random)));
  for (int i = 0; i < 3; ++i) p.abstracts.push_back(add(paint_abstract(384, 384, random)));
  for (int i = 0; i < 14; ++i) p.spines.push_back(add(paint_book_spine(random)));
  for (int i = 0; i < 5; ++i) p.covers.push_back(add(paint_book_cover(random)));
  for (int i = 0; i < 4; ++i) p.labels.push_back(add(paint_can_label(random)));
  p.led = add(paint_led());
  for (int i = 1; i <= 2; ++i) p.panels.push_back(add(paint_led_panel(i)));
  p.leaves = {add(paint_leaf({74, 128, 52}, random)), add(paint_leaf({98, 150, 70}, random)),
              add(paint_leaf({52, 98, 48}, random))};
}

}  // namespace

Palette paint_palette(uint64_t seed, Scene& scene) {
  Palette palette;
  paint_materials(seed, scene, palette);
  paint_prints(seed, scene, palette);
  return palette;
}

}  // namespace foresight::sim
