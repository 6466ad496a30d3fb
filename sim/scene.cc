#include "sim/scene.h"

#include <cmath>
#include <numbers>

#include "common/mesh.h"

namespace foresight::sim {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

int add_vertex(Scene& scene, const Vertex& vertex) {
  scene.vertices.push_back(vertex);
  return static_cast<int>(scene.vertices.size()) - 1;
}

TextureLevel white_light() {
  return {1, 1, {pack_texel(255 / kLightMapRange, 255 / kLightMapRange, 255 / kLightMapRange)}};
}

// Texture coordinates of the lower right corner.
Vector2f texture_extent(const Finish& finish, float width_m, float height_m) {
  if (finish.tile_m <= 0) return {1, 1};
  return {width_m / finish.tile_m, height_m / finish.tile_m};
}

// Adds a quadrilateral whose texture covers the columns u0 … u1.
int add_patch(Scene& scene, const Surface& surface, float u0, float u1, float v1) {
  const int index = static_cast<int>(scene.surfaces.size());
  scene.surfaces.push_back(surface);
  const auto& c = surface.corners;
  const int first = add_vertex(scene, {c[0], {u0, 0}, {0, 0}});
  add_vertex(scene, {c[1], {u1, 0}, {1, 0}});
  add_vertex(scene, {c[2], {u1, v1}, {1, 1}});
  add_vertex(scene, {c[3], {u0, v1}, {0, 1}});
  // Counter-clockwise seen by the viewer.
  scene.triangles.push_back({{first, first + 2, first + 1}, index});
  scene.triangles.push_back({{first, first + 3, first + 2}, index});
  return index;
}

struct Ring {
  Vector3f bottom, top, normal;
};

std::vector<Ring> rings_of(const Frame& frame, const Stump& shape) {
  std::vector<Ring> rings;
  const float slope = (shape.radius_bottom_m - shape.radius_top_m) / shape.height_m;
  for (int i = 0; i <= shape.segments; ++i) {
    const int wrapped = i % shape.segments;  // closes exactly
    const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(wrapped) /
                        static_cast<float>(shape.segments);
    const Vector3f out(std::cos(angle), std::sin(angle), 0);
    rings.push_back({frame * (out * shape.radius_bottom_m),
                     frame * (out * shape.radius_top_m + shape.height_m * Vector3f::UnitZ()),
                     (frame.linear() * (out + slope * Vector3f::UnitZ())).normalized()});
  }
  return rings;
}

void add_disc(Scene& scene, const std::string& name, const std::vector<Ring>& rings, bool top,
              const Frame& frame, const Stump& shape, const Finish& finish) {
  const float radius = top ? shape.radius_top_m : shape.radius_bottom_m;
  if (radius <= 0) return;
  const Vector3f centre = frame * Vector3f(0, 0, top ? shape.height_m : 0);
  const Vector3f right = -radius * frame.linear().col(1);
  const Vector3f down = (top ? -radius : radius) * frame.linear().col(0);
  const Vector3f normal = down.cross(right).normalized();
  const int index = static_cast<int>(scene.surfaces.size());
  scene.surfaces.push_back(
      {name,
       finish,
       {centre - right - down, centre + right - down, centre + right + down, centre - right + down},
       normal,
       normal,
       white_light()});
  const auto vertex = [&](const Vector3f& point) {
    const Vector3f offset = (point - centre) / (radius * radius);
    const Vector2f uv(0.5f + 0.5f * offset.dot(right), 0.5f + 0.5f * offset.dot(down));
    const float scale = finish.tile_m > 0 ? 2 * radius / finish.tile_m : 1;
    return add_vertex(scene, {point, uv * scale, uv});
  };
  const int middle = vertex(centre);
  for (int i = 0; i < shape.segments; ++i) {
    const int a = vertex(top ? rings[i].top : rings[i + 1].bottom);
    const int b = vertex(top ? rings[i + 1].top : rings[i].bottom);
    scene.triangles.push_back({{middle, a, b}, index});
  }
}

}  // namespace

Frame at(float x_m, float y_m, float z_m, float yaw_rad) {
  Frame frame = Frame::Identity();
  frame.translation() = Vector3f(x_m, y_m, z_m);
  frame.linear() = Eigen::AngleAxisf(yaw_rad, Vector3f::UnitZ()).toRotationMatrix();
  return frame;
}

int add_quad(Scene& scene, const std::string& name, const std::array<Vector3f, 4>& corners,
             const Finish& finish) {
  const Vector3f right = corners[1] - corners[0], down = corners[3] - corners[0];
  const Vector3f normal = down.cross(right).normalized();
  const Vector2f extent = texture_extent(finish, right.norm(), down.norm());
  return add_patch(scene, {name, finish, corners, normal, normal, white_light()}, 0, extent.x(),
                   extent.y());
}

BoxFinish all_sides(const Finish& finish) {
  return {finish, finish, finish, finish, finish, finish};
}

void add_box(Scene& scene, const std::string& name, const Frame& world_from_box,
             const Vector3f& size_m, const BoxFinish& finish) {
  const float x = size_m.x() / 2, y = size_m.y() / 2, z = size_m.z();
  const auto side = [&](const char* which, const Finish& look, const Vector3f& upper_left,
                        const Vector3f& right, const Vector3f& down) {
    const auto corner = [&](const Vector3f& point) -> Vector3f { return world_from_box * point; };
    add_quad(scene, name + which,
             {corner(upper_left), corner(upper_left + right), corner(upper_left + right + down),
              corner(upper_left + down)},
             look);
  };
  const Vector3f to_right(0, -2 * y, 0), to_left(0, 2 * y, 0), to_front(-2 * x, 0, 0),
      to_back(2 * x, 0, 0), down(0, 0, -z);
  side(".front", finish.front, {-x, y, z}, to_right, down);
  side(".back", finish.back, {x, -y, z}, to_left, down);
  side(".left", finish.left, {x, y, z}, to_front, down);
  side(".right", finish.right, {-x, -y, z}, to_back, down);
  side(".top", finish.top, {x, y, z}, to_right, to_front);
  side(".bottom", finish.bottom, {-x, y, 0}, to_right, to_back);
}

void add_stump(Scene& scene, const std::string& name, const Frame& world_from_stump,
               const Stump& shape, const Finish& side, const Finish& caps) {
  const std::vector<Ring> rings = rings_of(world_from_stump, shape);
  const float round =
      2 * std::numbers::pi_v<float> * std::max(shape.radius_bottom_m, shape.radius_top_m);
  const Vector2f extent = texture_extent(side, round, shape.height_m);
  for (int i = 0; i < shape.segments; ++i) {
    // Seen from outside, the angle grows to the right.
    const Ring &a = rings[i], &b = rings[i + 1];
    const float width = extent.x() / static_cast<float>(shape.segments);
    add_patch(scene,
              {name + ".side",
               side,
               {a.top, b.top, b.bottom, a.bottom},
               a.normal,
               b.normal,
               white_light()},
              static_cast<float>(i) * width, static_cast<float>(i + 1) * width, extent.y());
  }
  add_disc(scene, name + ".top", rings, true, world_from_stump, shape, caps);
  add_disc(scene, name + ".bottom", rings, false, world_from_stump, shape, caps);
}

int add_dome(Scene& scene, const std::string& name, const Frame& world_from_dome, float radius_m,
             float height_m, const Finish& finish) {
  constexpr int kSegments = 12;
  const int index = static_cast<int>(scene.surfaces.size());
  const auto point = [&](float x, float y, float z) -> Vector3f {
    return world_from_dome * Vector3f(x * radius_m, y * radius_m, z * height_m);
  };
  const Vector3f normal = world_from_dome.linear().col(2);
  // Seen from its top with x up: y is to the left.
  scene.surfaces.push_back({name,
                            finish,
                            {point(1, 1, 1), point(1, -1, 1), point(-1, -1, 1), point(-1, 1, 1)},
                            normal,
                            normal,
                            white_light()});
  const auto vertex = [&](int i, float share, float z) {
    const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(i % kSegments) /
                        static_cast<float>(kSegments);
    const float x = share * std::cos(angle), y = share * std::sin(angle);
    const Vector2f uv(0.5f - 0.5f * y, 0.5f - 0.5f * x);
    return add_vertex(scene, {point(x, y, z), uv, uv});
  };
  const int top = vertex(0, 0, 1);
  for (int i = 0; i < kSegments; ++i) {
    const int inner = vertex(i, 0.65f, 0.75f), next_inner = vertex(i + 1, 0.65f, 0.75f);
    const int outer = vertex(i, 1, 0), next_outer = vertex(i + 1, 1, 0);
    scene.triangles.push_back({{top, inner, next_inner}, index});
    scene.triangles.push_back({{inner, outer, next_outer}, index});
    scene.triangles.push_back({{inner, next_outer, next_inner}, index});
  }
  return index;
}

std::optional<std::string> write_scene_ply(const Scene& scene, const std::string& path) {
  Mesh mesh;
  for (const Vertex& vertex : scene.vertices) {
    mesh.vertices_in_map.push_back(vertex.point_in_world);
    mesh.vertex_ids.emplace_back(static_cast<int32_t>(mesh.vertex_ids.size()));
    mesh.confidences.push_back(1);
  }
  for (const Triangle& triangle : scene.triangles) {
    mesh.triangles.push_back({triangle.vertices[0], triangle.vertices[1], triangle.vertices[2]});
  }
  return write_ply(mesh, path);
}

}  // namespace foresight::sim
