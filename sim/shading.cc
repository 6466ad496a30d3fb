#include "sim/shading.h"

#include <algorithm>
#include <cmath>

namespace foresight::sim {

using Eigen::Vector3f;

Shader::Shader(const Scene& scene) {
  facets_.reserve(scene.triangles.size());
  for (const Triangle& triangle : scene.triangles) facets_.push_back(facet_of(scene, triangle));
}

Shader::Affine Shader::affine(const std::array<Vector3f, 3>& points,
                              const std::array<float, 3>& values) {
  const Eigen::Vector3d a = (points[1] - points[0]).cast<double>();
  const Eigen::Vector3d b = (points[2] - points[0]).cast<double>();
  const double aa = a.dot(a), ab = a.dot(b), bb = b.dot(b), det = aa * bb - ab * ab;
  if (!(det > 0)) return {Vector3f::Zero(), values[0]};
  const double da = values[1] - values[0], db = values[2] - values[0];
  const Eigen::Vector3d slope = ((bb * da - ab * db) * a + (aa * db - ab * da) * b) / det;
  return {slope.cast<float>(), static_cast<float>(values[0] - slope.dot(points[0].cast<double>()))};
}

Shader::Facet Shader::facet_of(const Scene& scene, const Triangle& triangle) {
  std::array<Vector3f, 3> points;
  std::array<float, 3> u, v, light_x, light_y;
  const Surface& surface = scene.surfaces[triangle.surface];
  const Texture& texture = scene.textures[surface.finish.texture];
  for (size_t i = 0; i < 3; ++i) {
    const Vertex& vertex = scene.vertices[triangle.vertices[i]];
    points[i] = vertex.point_in_world;
    u[i] = vertex.texture_uv.x(), v[i] = vertex.texture_uv.y();
    light_x[i] = vertex.light_uv.x() * static_cast<float>(surface.light.width - 1);
    light_y[i] = vertex.light_uv.y() * static_cast<float>(surface.light.height - 1);
  }
  Facet facet;
  facet.normal = (points[1] - points[0]).cross(points[2] - points[0]).normalized();
  facet.plane_offset = facet.normal.dot(points[0]);
  facet.texture_u = affine(points, u);
  facet.texture_v = affine(points, v);
  facet.light_x = affine(points, light_x);
  facet.light_y = affine(points, light_y);
  facet.texels_per_m =
      std::max(facet.texture_u.slope.norm() * static_cast<float>(texture.levels[0].width),
               facet.texture_v.slope.norm() * static_cast<float>(texture.levels[0].height));
  facet.texture = &texture;
  facet.light = &surface.light;
  facet.surface = triangle.surface;
  return facet;
}

Colour Shader::shade(int triangle, const Vector3f& origin, const Vector3f& direction,
                     float pixel_width) const {
  const Facet& facet = facets_[triangle];
  const float along = facet.normal.dot(direction);
  const float distance = (facet.plane_offset - facet.normal.dot(origin)) / along;
  const Vector3f point = origin + distance * direction;

  // A pixel covers `width` across and width/cosine along the slope; the texture is filtered for
  // the geometric mean of both, a compromise between blur and aliasing.
  const float width = distance * pixel_width * facet.texels_per_m;
  const float cosine_squared = along * along / direction.squaredNorm();
  const float footprint = width / std::sqrt(std::sqrt(std::max(cosine_squared, 1e-3f)));
  const FixedColour paint =
      sample_texture(*facet.texture, facet.texture_u(point), facet.texture_v(point), footprint);

  const TextureLevel& map = *facet.light;
  const float x = std::clamp(facet.light_x(point), 0.0f, static_cast<float>(map.width - 1));
  const float y = std::clamp(facet.light_y(point), 0.0f, static_cast<float>(map.height - 1));
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const FixedColour light =
      blend_texels(map, x0, std::min(x0 + 1, map.width - 1), y0, std::min(y0 + 1, map.height - 1),
                   static_cast<uint32_t>((x - static_cast<float>(x0)) * 256),
                   static_cast<uint32_t>((y - static_cast<float>(y0)) * 256));

  constexpr float kScale = kLightMapRange / 255 / 256 / 256;
  const auto product = [](uint32_t a, uint32_t b) {
    return kScale * static_cast<float>(static_cast<int>(a)) *
           static_cast<float>(static_cast<int>(b));
  };
  return {product(paint.red_and_blue & 0xFFFF, light.red_and_blue & 0xFFFF),
          product(paint.green, light.green),
          product(paint.red_and_blue >> 16, light.red_and_blue >> 16)};
}

}  // namespace foresight::sim
