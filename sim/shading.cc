#include "sim/shading.h"

#include <algorithm>
#include <cmath>

#include "common/check.h"

namespace foresight::sim {

using Eigen::Vector3f;

namespace {

// Bilinear, at (x, y) in texels within the map.
FixedColour sample_light(const TextureLevel& map, float x, float y) {
  const int x_fixed = static_cast<int>(x * 256), y_fixed = static_cast<int>(y * 256);
  const int x0 = x_fixed >> 8, y0 = y_fixed >> 8;
  return blend_texels(map, x0, std::min(x0 + 1, map.width - 1), y0,
                      std::min(y0 + 1, map.height - 1), static_cast<uint32_t>(x_fixed & 255),
                      static_cast<uint32_t>(y_fixed & 255));
}

Colour lit(const FixedColour& paint, const FixedColour& light, float gain) {
  const float scale = gain * (kLightMapRange / 255 / 256 / 256);
  const auto product = [scale](uint32_t a, uint32_t b) {
    return scale * static_cast<float>(static_cast<int>(a)) *
           static_cast<float>(static_cast<int>(b));
  };
  return {product(paint.red_and_blue & 0xFFFF, light.red_and_blue & 0xFFFF),
          product(paint.green, light.green),
          product(paint.red_and_blue >> 16, light.red_and_blue >> 16)};
}

// The light map of everything that glows; its gain makes the brightness.
const TextureLevel& full_light() {
  static const TextureLevel map{1, 1, {pack_texel(255, 255, 255)}};
  return map;
}

}  // namespace

Shader::Shader(const Scene& scene) : scene_(scene) {
  facets_.reserve(scene.triangles.size());
  for (const Triangle& triangle : scene.triangles) facets_.push_back(facet_of(scene, triangle));
  lights_.resize(scene.surfaces.size());
  for (size_t i = 0; i < lights_.size(); ++i) {
    set_glow(static_cast<int>(i), scene.surfaces[i].finish.glow);
  }
}

void Shader::set_glow(int surface, float glow) {
  FORESIGHT_CHECK(surface >= 0 && static_cast<size_t>(surface) < lights_.size());
  lights_[surface] = glow > 0 ? Light{&full_light(), glow / kLightMapRange}
                              : Light{&scene_.surfaces[surface].light, 1};
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
  facet.surface = triangle.surface;
  return facet;
}

Shader::Coordinates Shader::locate(const Facet& facet, const TextureLevel& light,
                                   const RayPacket& rays) {
  Coordinates c;
  const Vector3f& o = rays.origin;
  const Vector3f& n = facet.normal;
  const float height = facet.plane_offset - n.dot(o);
  const float last_x = static_cast<float>(light.width - 1);
  const float last_y = static_cast<float>(light.height - 1);
  for (int i = 0; i < kPacket; ++i) {
    const float dx = rays.x[i], dy = rays.y[i], dz = rays.z[i];
    const float distance = height / (n.x() * dx + n.y() * dy + n.z() * dz);
    const float x = o.x() + distance * dx, y = o.y() + distance * dy, z = o.z() + distance * dz;
    c.distance[i] = distance;
    c.u[i] = facet.texture_u.at(x, y, z);
    c.v[i] = facet.texture_v.at(x, y, z);
    c.light_x[i] = std::min(std::max(facet.light_x.at(x, y, z), 0.0f), last_x);
    c.light_y[i] = std::min(std::max(facet.light_y.at(x, y, z), 0.0f), last_y);
  }
  return c;
}

// A pixel covers `width` across and width/cosine along the slope; the texture is filtered for the
// geometric mean of both, a compromise between blur and aliasing.
TextureFilter Shader::filter_for(const Facet& facet, const RayPacket& rays, int ray, float distance,
                                 float pixel_width) {
  const Vector3f direction(rays.x[ray], rays.y[ray], rays.z[ray]);
  const float along = facet.normal.dot(direction);
  const float cosine_squared = along * along / direction.squaredNorm();
  const float width = distance * pixel_width * facet.texels_per_m;
  return texture_filter(*facet.texture,
                        width / std::sqrt(std::sqrt(std::max(cosine_squared, 1e-3f))));
}

float Shader::depth(const RayPacket& rays, int ray) const {
  const Facet& facet = facets_[rays.triangle[ray]];
  const Vector3f direction(rays.x[ray], rays.y[ray], rays.z[ray]);
  return (facet.plane_offset - facet.normal.dot(rays.origin)) / facet.normal.dot(direction);
}

void Shader::shade(const RayPacket& rays, float pixel_width,
                   std::array<Colour, kPacket>& colours) const {
  colours.fill({});
  std::array<int, kPacket> left = rays.triangle;  // −1 once done
  for (int first = 0; first < kPacket; ++first) {
    const int triangle = left[first];
    if (triangle < 0) continue;
    const Facet& facet = facets_[triangle];
    const Light& light = lights_[facet.surface];
    const Coordinates c = locate(facet, *light.map, rays);
    const TextureFilter filter = filter_for(facet, rays, first, c.distance[first], pixel_width);
    for (int i = first; i < kPacket; ++i) {
      if (left[i] != triangle) continue;
      left[i] = -1;
      const FixedColour paint = sample_texture(*facet.texture, filter, c.u[i], c.v[i]);
      colours[i] = lit(paint, sample_light(*light.map, c.light_x[i], c.light_y[i]), light.gain);
    }
  }
}

}  // namespace foresight::sim
