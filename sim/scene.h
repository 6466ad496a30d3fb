// The world that the ray-traced camera looks at: textured triangles with baked light. Plain data in
// world coordinates (metres, z up; world is the arm's base frame, see lab.h).
//
//   Scene scene;
//   const Finish wood{scene.add_texture(make_texture(paint_wood(...), true)), 1.0f};
//   add_box(scene, "crate", at(1.2f, 0.3f, -0.3f, 0.1f), {0.3f, 0.4f, 0.2f}, all_sides(wood));
//   bake_lighting(scene);   // lighting.h
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "common/frames.h"
#include "sim/texture.h"

namespace foresight::sim {

/// Brightness that a light map's 255 stands for: texture level × light = picture level.
constexpr float kLightMapRange = 1.6f;

/// How a surface looks.
struct Finish {
  int texture = 0;
  float tile_m = 0;  // side of one repeat; 0 stretches the texture over the surface
  float glow = 0;    // > 0: shines by itself at this brightness, whatever lights the room;
                     // RayCamera::set_glow() changes it later
  float light_step_m = 0.02f;  // distance between the samples of its light map
};

/// A piece of something visible: a quadrilateral, or a disc in its bounding square.
struct Surface {
  std::string name;
  Finish finish;
  /// Upper left, upper right, lower right, lower left: what the light map spans.
  std::array<Eigen::Vector3f, 4> corners;
  Eigen::Vector3f normal_left, normal_right;  // for the light only; differ on round things
  TextureLevel light;                         // one texel of white until baked
};

struct Vertex {
  Eigen::Vector3f point_in_world;
  Eigen::Vector2f texture_uv;
  Eigen::Vector2f light_uv;  // (0, 0) at corners[0], (1, 1) at corners[2]
};

struct Triangle {
  std::array<int, 3> vertices;
  int surface = 0;
};

/// A rectangle that shines (a ceiling lamp, a window) on the side of edge_a × edge_b.
struct Lamp {
  Eigen::Vector3f corner, edge_a, edge_b;
  Eigen::Vector3f radiance;  // red, green, blue; 1 m² of radiance 1 lights a wall 1 m away to 1
};

/// The front of something flat, as a coordinate frame: origin in its middle, x right, y down, z
/// into it, as its viewer sees it. A camera that faces it squarely has the same axes.
struct Face {};

/// Something flat that an experiment asks for, such as a card with a letter.
struct Target {
  std::string name;
  Pose<World, Face> world_from_face;
  double width_m = 0, height_m = 0;
};

/// A panel with 3×3 lamps. Lit and put out by RayCamera::light_led().
struct LedPanel {
  Target target;
  std::array<int, 9> surfaces{};  // of the LEDs, in rows from the upper left
  static constexpr float kLitGlow = 4.5f;
};

struct Scene {
  std::vector<Texture> textures;
  std::vector<Surface> surfaces;
  std::vector<Vertex> vertices;
  std::vector<Triangle> triangles;
  std::vector<Lamp> lamps;
  std::vector<Target> targets;
  std::vector<LedPanel> led_panels;

  int add_texture(Texture texture) {
    textures.push_back(std::move(texture));
    return static_cast<int>(textures.size()) - 1;
  }
};

using Frame = Eigen::Isometry3f;  // world_from_object

/// An upright object at a place, turned about the vertical. Objects face −x, towards the arm.
Frame at(float x_m, float y_m, float z_m, float yaw_rad = 0);

/// A flat quadrilateral, corners as seen by its viewer: upper left, upper right, lower right, lower
/// left. Returns the surface's index.
int add_quad(Scene& scene, const std::string& name, const std::array<Eigen::Vector3f, 4>& corners,
             const Finish& finish);

struct BoxFinish {
  Finish front, back, left, right, top, bottom;  // front faces −x, left +y
};
BoxFinish all_sides(const Finish& finish);

/// A box that stands with its bottom's centre on the frame's origin; size = depth x, width y,
/// height z.
void add_box(Scene& scene, const std::string& name, const Frame& world_from_box,
             const Eigen::Vector3f& size_m, const BoxFinish& finish);

/// A cylinder or cone stump on the frame's origin, along z. The side texture goes round once when
/// stretched.
struct Stump {
  float radius_bottom_m = 0.05f;
  float radius_top_m = 0.05f;
  float height_m = 0.1f;
  int segments = 20;
};
void add_stump(Scene& scene, const std::string& name, const Frame& world_from_stump,
               const Stump& shape, const Finish& side, const Finish& caps);

/// A shallow dome on the frame's origin, along z: one surface, with the texture seen from its top.
/// Returns the surface's index.
int add_dome(Scene& scene, const std::string& name, const Frame& world_from_dome, float radius_m,
             float height_m, const Finish& finish);

/// Writes the triangles as binary PLY. An error line, or nothing on success.
[[nodiscard]] std::optional<std::string> write_scene_ply(const Scene& scene,
                                                         const std::string& path);

}  // namespace foresight::sim
