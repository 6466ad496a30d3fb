#include "sim/furniture.h"

#include <cmath>
#include <numbers>

namespace foresight::sim {
namespace {

using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;

Frame moved(const Frame& frame, float x_m, float y_m, float z_m, float yaw_rad = 0) {
  return frame * at(x_m, y_m, z_m, yaw_rad);
}

Frame tilted(const Frame& frame, const Vector3f& axis, float angle_rad) {
  return frame * Eigen::AngleAxisf(angle_rad, axis);
}

// The front of a box that add_box() made.
Target front_target(const std::string& name, const Frame& box, const Vector3f& size_m) {
  Eigen::Matrix3f box_from_face;  // x right is −y, y down is −z, z into it is x
  box_from_face << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const Eigen::Matrix3f world_from_face = box.linear() * box_from_face;
  const Vector3f middle = box * Vector3f(-size_m.x() / 2, 0, size_m.z() / 2);
  return {name,
          {Eigen::Matrix3d(world_from_face.cast<double>()), middle.cast<double>()},
          size_m.y(),
          size_m.z()};
}

}  // namespace

void Furnisher::desk(const std::string& name, const Frame& frame, const Vector3f& size_m) {
  constexpr float kThickness_m = 0.04f, kLeg_m = 0.06f;
  Finish top = stretched(palette_.desk_wood);
  top.light_step_m = 0.012f;
  BoxFinish slab = all_sides(tiled(palette_.shelf_wood, 0.6f));
  slab.top = top;
  add_box(scene_, name, moved(frame, 0, 0, size_m.z() - kThickness_m),
          {size_m.x(), size_m.y(), kThickness_m}, slab);
  Finish metal = tiled(palette_.dark_metal, 0.3f);
  metal.light_step_m = 0.05f;
  for (const float x : {-1.0f, 1.0f}) {
    for (const float y : {-1.0f, 1.0f}) {
      add_box(scene_, name + ".leg",
              moved(frame, x * (size_m.x() / 2 - 0.07f), y * (size_m.y() / 2 - 0.07f), 0),
              {kLeg_m, kLeg_m, size_m.z() - kThickness_m}, all_sides(metal));
    }
  }
}

void Furnisher::shelf_unit(const Frame& frame, const Vector3f& size_m, int boards) {
  constexpr float kBoard_m = 0.025f;
  Finish wood = tiled(palette_.shelf_wood, 0.7f);
  wood.light_step_m = 0.04f;
  for (const float side : {-1.0f, 1.0f}) {
    add_box(scene_, "shelf.side", moved(frame, 0, side * (size_m.y() - kBoard_m) / 2, 0),
            {size_m.x(), kBoard_m, size_m.z()}, all_sides(wood));
  }
  const float inner_m = size_m.y() - 2 * kBoard_m;
  const float pitch_m = (size_m.z() - kBoard_m) / static_cast<float>(boards - 1);
  for (int i = 0; i < boards; ++i) {
    const float z = pitch_m * static_cast<float>(i);
    add_box(scene_, "shelf.board", moved(frame, 0, 0, z), {size_m.x(), inner_m, kBoard_m},
            all_sides(wood));
    if (i + 1 == boards) continue;
    const Frame board = moved(frame, -0.03f, 0, z + kBoard_m);
    const float books_m = inner_m * vary(0.4, 0.65), free_m = inner_m - books_m;
    book_row(moved(board, 0, free_m / 2 - 0.01f, 0), books_m, 0.75f * pitch_m);
    const Frame rest = moved(board, 0, -books_m / 2, 0);
    if (i % 2 == 0) {
      carton(rest, {0.2f, free_m * 0.7f, 0.55f * pitch_m});
    } else {
      can(moved(rest, 0, 0.06f, 0));
      mug(moved(rest, -0.04f, -0.08f, 0));
    }
  }
}

void Furnisher::wall_shelf(const Frame& frame, float depth_m, float width_m) {
  add_box(scene_, "wall_shelf", frame, {depth_m, width_m, 0.025f},
          all_sides(tiled(palette_.shelf_wood, 0.7f)));
  const Frame board = moved(frame, 0, 0, 0.025f);
  const float books_m = width_m * 0.55f;
  book_row(moved(board, 0.01f, (width_m - books_m) / 2 - 0.02f, 0), books_m, 0.24f);
  can(moved(board, 0, -width_m * 0.14f, 0));
  picture_box(moved(board, 0.02f, -width_m * 0.33f, 0, vary(-0.3, 0.3)), {0.08f, 0.2f, 0.17f},
              pick(palette_.landscapes));
}

void Furnisher::chair(const Frame& frame) {
  const Finish fabric = tiled(palette_.fabric, 0.25f), metal = tiled(palette_.dark_metal, 0.3f);
  add_box(scene_, "chair.seat", moved(frame, 0, 0, 0.44f), {0.42f, 0.44f, 0.06f},
          all_sides(fabric));
  add_box(scene_, "chair.back", tilted(moved(frame, 0.2f, 0, 0.5f), Vector3f::UnitY(), 0.12f),
          {0.04f, 0.42f, 0.42f}, all_sides(fabric));
  for (const float x : {-0.17f, 0.17f}) {
    for (const float y : {-0.18f, 0.18f}) {
      add_box(scene_, "chair.leg", moved(frame, x, y, 0), {0.03f, 0.03f, 0.44f}, all_sides(metal));
    }
  }
}

void Furnisher::monitor(const Frame& frame) {
  const Finish plastic = tiled(palette_.dark_plastic, 0.2f);
  add_stump(scene_, "monitor.foot", frame, {0.12f, 0.11f, 0.012f, 24}, plastic, plastic);
  add_box(scene_, "monitor.neck", moved(frame, 0.02f, 0, 0.01f), {0.025f, 0.06f, 0.2f},
          all_sides(plastic));
  const Frame panel = tilted(moved(frame, 0, 0, 0.1f), Vector3f::UnitY(), 0.06f);
  add_box(scene_, "monitor.case", panel, {0.035f, 0.56f, 0.34f}, all_sides(plastic));
  const float x = -0.0185f, y = 0.265f;
  const auto corner = [&](float side, float z) -> Vector3f { return panel * Vector3f(x, side, z); };
  add_quad(scene_, "monitor.screen",
           {corner(y, 0.325f), corner(-y, 0.325f), corner(-y, 0.03f), corner(y, 0.03f)},
           {palette_.screen, 0, 0.95f});
}

void Furnisher::lamp(const Frame& frame) {
  const Finish metal = tiled(palette_.dark_metal, 0.2f), shade = tiled(palette_.grey_plastic, 0.2f);
  add_stump(scene_, "lamp.foot", frame, {0.08f, 0.07f, 0.02f, 20}, metal, metal);
  const Frame lower = tilted(moved(frame, 0, 0, 0.02f), Vector3f::UnitY(), 0.25f);
  add_stump(scene_, "lamp.arm", lower, {0.009f, 0.009f, 0.3f, 8}, metal, metal);
  const Frame upper = tilted(moved(lower, 0, 0, 0.3f), Vector3f::UnitY(), -1.1f);
  add_stump(scene_, "lamp.arm", upper, {0.009f, 0.009f, 0.22f, 8}, metal, metal);
  const Frame head = tilted(moved(upper, 0, 0, 0.2f), Vector3f::UnitY(), -1.5f);
  add_stump(scene_, "lamp.shade", moved(head, 0, 0, -0.02f), {0.03f, 0.075f, 0.11f, 20}, shade,
            shade);
}

void Furnisher::plant(const Frame& frame, float height_m) {
  const Finish clay = tiled(palette_.clay, 0.2f);
  add_stump(scene_, "plant.pot", frame, {0.055f, 0.08f, 0.13f, 20}, clay, clay);
  add_stump(scene_, "plant.stem", moved(frame, 0, 0, 0.13f), {0.008f, 0.005f, height_m * 0.5f, 6},
            stretched(palette_.leaves[2]), stretched(palette_.leaves[2]));
  for (int i = 0; i < 26; ++i) {
    const float around = 2.4f * static_cast<float>(i) + vary(-0.3, 0.3);
    const float length = height_m * vary(0.3, 0.55), rise = vary(0.15, 1.1);
    const Frame leaf = moved(frame, 0, 0, 0.13f + height_m * vary(0.1, 0.5)) *
                       Eigen::AngleAxisf(around, Vector3f::UnitZ()) *
                       Eigen::AngleAxisf(-rise, Vector3f::UnitY());
    const float half = 0.16f * length;
    const auto point = [&](float x, float y, float z) -> Vector3f {
      return leaf * Vector3f(x, y, z);
    };
    const Vector3f middle_left = point(0.5f * length, half, 0.02f);
    const Vector3f middle_right = point(0.5f * length, -half, 0.02f);
    const Finish green = stretched(pick(palette_.leaves));
    add_quad(scene_, "plant.leaf",
             {point(0, 0.006f, 0), middle_left, middle_right, point(0, -0.006f, 0)}, green);
    add_quad(
        scene_, "plant.leaf",
        {middle_left, point(length, 0.003f, -0.05f), point(length, -0.003f, -0.05f), middle_right},
        green);
  }
}

void Furnisher::mug(const Frame& frame) {
  add_stump(scene_, "mug", frame, {0.038f, 0.042f, 0.095f, 24}, stretched(pick(palette_.abstracts)),
            tiled(palette_.dark_plastic, 0.1f));
  const Finish handle = tiled(palette_.white, 0.1f);
  for (const float z : {0.025f, 0.065f}) {
    add_box(scene_, "mug.handle", moved(frame, 0, -0.054f, z), {0.012f, 0.03f, 0.01f},
            all_sides(handle));
  }
  add_box(scene_, "mug.handle", moved(frame, 0, -0.07f, 0.025f), {0.012f, 0.01f, 0.05f},
          all_sides(handle));
}

void Furnisher::can(const Frame& frame) {
  const Finish metal = tiled(palette_.grey_plastic, 0.2f);
  add_stump(scene_, "can", moved(frame, 0, 0, 0, vary(0, 2 * kPi)), {0.037f, 0.037f, 0.12f, 24},
            stretched(pick(palette_.labels)), metal);
}

void Furnisher::carton(const Frame& frame, const Vector3f& size_m) {
  BoxFinish finish = all_sides(stretched(palette_.cardboard));
  finish.front = finish.left = finish.right = stretched(palette_.cardboard_printed);
  add_box(scene_, "carton", frame, size_m, finish);
}

void Furnisher::letter_card(const Frame& frame, size_t letter) {
  const Vector3f size_m(0.006f, 0.1f, 0.1f);
  BoxFinish finish = all_sides(tiled(palette_.white, 0.1f));
  finish.front = stretched(palette_.letters[letter]);
  const std::string name(1, static_cast<char>('A' + letter));
  const Frame card = tilted(frame, Vector3f::UnitY(), 0.2f);
  add_box(scene_, "letter_" + name, card, size_m, finish);
  scene_.targets.push_back(front_target(name, card, size_m));
}

void Furnisher::picture_box(const Frame& frame, const Vector3f& size_m, int texture) {
  add_box(scene_, "picture_box", frame, size_m, all_sides(stretched(texture)));
}

void Furnisher::book_row(const Frame& frame, float width_m, float height_m) {
  float y = width_m / 2;
  while (true) {
    const float thickness = vary(0.018, 0.05), height = height_m * vary(0.72, 1.0);
    if (y - thickness < -width_m / 2) break;
    BoxFinish book = all_sides(stretched(palette_.page_edges));
    book.front = stretched(pick(palette_.spines));
    book.left = book.right = stretched(pick(palette_.covers));
    add_box(scene_, "book", moved(frame, vary(-0.015, 0.015), y - thickness / 2, 0),
            {height * 0.7f, thickness - 0.001f, height}, book);
    y -= thickness;
  }
}

void Furnisher::book_stack(const Frame& frame, int count) {
  float z = 0;
  for (int i = 0; i < count; ++i) {
    const float thickness = vary(0.02, 0.045);
    // A book on its side: lies on its left cover, spine to the front.
    Frame book = moved(frame, vary(-0.01, 0.01), 0, z + thickness / 2, vary(-0.25, 0.25));
    const float height = vary(0.2, 0.25);
    book = book * Eigen::AngleAxisf(kPi / 2, Vector3f::UnitX());
    BoxFinish finish = all_sides(stretched(palette_.page_edges));
    finish.front = stretched(pick(palette_.spines));
    finish.left = finish.right = stretched(pick(palette_.covers));
    add_box(scene_, "book", moved(book, 0, 0, -height / 2), {0.7f * height, thickness, height},
            finish);
    z += thickness + 0.0005f;
  }
}

void Furnisher::led_panel(const Frame& frame, const std::bitset<9>& lit) {
  constexpr float kSide_m = 0.08f, kDepth_m = 0.012f, kPitch_m = 0.022f;
  const size_t number = scene_.led_panels.size();
  const Frame panel = tilted(frame, Vector3f::UnitY(), 0.25f);
  BoxFinish finish = all_sides(tiled(palette_.dark_plastic, 0.2f));
  finish.front = stretched(palette_.panels[number % palette_.panels.size()]);
  add_box(scene_, "led_panel", panel, {kDepth_m, kSide_m, kSide_m}, finish);
  const std::string name = "panel_" + std::to_string(number + 1);
  LedPanel record{front_target(name, panel, {kDepth_m, kSide_m, kSide_m}), {}};
  for (int i = 0; i < 9; ++i) {
    const float y = kPitch_m * static_cast<float>(1 - i % 3);
    const float z = kSide_m / 2 + kPitch_m * static_cast<float>(1 - i / 3);
    const Frame led = tilted(moved(panel, -kDepth_m / 2, y, z), Vector3f::UnitY(), -kPi / 2);
    const Finish rim = tiled(palette_.grey_plastic, 0.1f);
    add_stump(scene_, "led_rim", led, {0.0075f, 0.0065f, 0.0015f, 16}, rim, rim);
    const bool on = lit[static_cast<size_t>(i)];
    record.surfaces[static_cast<size_t>(i)] =
        add_dome(scene_, "led_" + std::to_string(i) + ".top", moved(led, 0, 0, 0.0016f), 0.0055f,
                 0.003f, {palette_.led, 0, on ? LedPanel::kLitGlow : 0});
  }
  scene_.led_panels.push_back(record);
}

void Furnisher::sheet(const std::string& name, const Frame& frame, float depth_m, float width_m,
                      int texture) {
  BoxFinish finish = all_sides(tiled(palette_.white, 0.1f));
  finish.top = stretched(texture);
  add_box(scene_, name, frame, {depth_m, width_m, 0.0015f}, finish);
}

void Furnisher::keyboard(const Frame& frame) {
  BoxFinish finish = all_sides(tiled(palette_.dark_plastic, 0.2f));
  finish.top = stretched(palette_.keyboard);
  add_box(scene_, "keyboard", frame, {0.14f, 0.44f, 0.02f}, finish);
}

}  // namespace foresight::sim
