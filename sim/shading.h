// What rays see: the texture and the baked light where they meet the scene. Works from the rays and
// the triangles' planes alone, so the answer does not depend on the ray tracer's arithmetic.
#pragma once

#include <array>
#include <vector>

#include "sim/scene.h"

namespace foresight::sim {

constexpr int kPacket = 16;  // rays that are traced and shaded together

struct Colour {
  float red = 0, green = 0, blue = 0;  // picture levels, 0 … 255 (and above)
};

/// Rays from one eye. A direction's length is 1 along the optical axis, so that the distance along
/// the ray is the depth.
struct RayPacket {
  Eigen::Vector3f origin;
  std::array<float, kPacket> x{}, y{}, z{};  // directions
  std::array<int, kPacket> triangle{};       // index in scene.triangles, −1 where nothing is met
};

class Shader {
 public:
  /// Keeps a reference to the scene.
  explicit Shader(const Scene& scene);

  /// Depth of a ray of the packet, which must have met a triangle.
  float depth(const RayPacket& rays, int ray) const;

  /// Colours of all rays, black where nothing is met. `pixel_width` is 1 / focal length in pixels.
  void shade(const RayPacket& rays, float pixel_width, std::array<Colour, kPacket>& colours) const;

  int surface(int triangle) const { return facets_[triangle].surface; }

  /// From now on the surface shines at this brightness; 0 gives it back its baked light.
  void set_glow(int surface, float glow);

 private:
  // A coordinate as an affine function of the point: xyz·point + w.
  struct Affine {
    Eigen::Vector3f slope;
    float offset;
    float at(float x, float y, float z) const {
      return slope.x() * x + slope.y() * y + slope.z() * z + offset;
    }
  };
  struct Facet {
    Eigen::Vector3f normal;
    float plane_offset;
    Affine texture_u, texture_v, light_x, light_y;  // light in texels
    float texels_per_m;
    const Texture* texture;
    int surface;
  };
  // What lights a surface: its light map, or for one that glows a map of white.
  struct Light {
    const TextureLevel* map;
    float gain;
  };
  // Where all rays of a packet would meet a facet's plane.
  struct Coordinates {
    std::array<float, kPacket> distance, u, v, light_x, light_y;
  };
  static Affine affine(const std::array<Eigen::Vector3f, 3>& points,
                       const std::array<float, 3>& values);
  static Facet facet_of(const Scene& scene, const Triangle& triangle);
  static Coordinates locate(const Facet& facet, const TextureLevel& light, const RayPacket& rays);
  static TextureFilter filter_for(const Facet& facet, const RayPacket& rays, int ray,
                                  float distance, float pixel_width);

  const Scene& scene_;
  std::vector<Facet> facets_;
  std::vector<Light> lights_;  // per surface
};

}  // namespace foresight::sim
