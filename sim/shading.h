// What a ray sees: the texture and the baked light where it meets the scene. Works from the ray and
// the triangle's plane alone, so the answer does not depend on the ray tracer's arithmetic.
#pragma once

#include "sim/scene.h"

namespace foresight::sim {

struct Colour {
  float red = 0, green = 0, blue = 0;  // picture levels, 0 … 255 (and above)
};

class Shader {
 public:
  /// Keeps a reference to the scene.
  explicit Shader(const Scene& scene);

  /// Distance along the ray, in multiples of its direction, to the triangle's plane.
  float distance(int triangle, const Eigen::Vector3f& origin,
                 const Eigen::Vector3f& direction) const {
    const Facet& facet = facets_[triangle];
    return (facet.plane_offset - facet.normal.dot(origin)) / facet.normal.dot(direction);
  }

  /// `pixel_width` is the width of a pixel at direction length 1: |z-depth 1| / focal length.
  Colour shade(int triangle, const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
               float pixel_width) const;

  int surface(int triangle) const { return facets_[triangle].surface; }

 private:
  // Each coordinate is an affine function of the point: xyz·point + w.
  struct Affine {
    Eigen::Vector3f slope;
    float offset;
    float operator()(const Eigen::Vector3f& point) const { return slope.dot(point) + offset; }
  };
  struct Facet {
    Eigen::Vector3f normal;
    float plane_offset;
    Affine texture_u, texture_v, light_x, light_y;  // light in texels
    float texels_per_m;
    const Texture* texture;
    const TextureLevel* light;
    int surface;
  };
  static Affine affine(const std::array<Eigen::Vector3f, 3>& points,
                       const std::array<float, 3>& values);
  static Facet facet_of(const Scene& scene, const Triangle& triangle);

  std::vector<Facet> facets_;
};

}  // namespace foresight::sim
