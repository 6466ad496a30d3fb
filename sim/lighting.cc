#include "sim/lighting.h"

#include <algorithm>
#include <cmath>

#include "sim/ray_tracer.h"

namespace foresight::sim {
namespace {

using Eigen::Vector3f;

constexpr int kRays = 16;
constexpr float kLift_m = 2e-3f;  // off the surface, so that it does not shadow itself

struct Sample {
  Vector3f point, normal;
};

// Cosine-weighted directions around +z (a golden-angle spiral on the disc).
std::array<Vector3f, kRays> hemisphere() {
  std::array<Vector3f, kRays> directions;
  for (int i = 0; i < kRays; ++i) {
    const float radius = std::sqrt((static_cast<float>(i) + 0.5f) / kRays);
    const float angle = 2.3999632f * static_cast<float>(i);
    directions[i] = {radius * std::cos(angle), radius * std::sin(angle),
                     std::sqrt(1 - radius * radius)};
  }
  return directions;
}

class Baker {
 public:
  Baker(const Scene& scene, const LightingParams& params)
      : scene_(scene), params_(params), tracer_(scene), hemisphere_(hemisphere()) {}

  Vector3f light_at(const Sample& sample) const {
    Vector3f light = ambient(sample);
    for (const Lamp& lamp : scene_.lamps) light += from_lamp(lamp, sample);
    return light;
  }

 private:
  static void set_ray(RTCRay16& rays, int i, const Vector3f& from, const Vector3f& direction,
                      float reach) {
    rays.org_x[i] = from.x(), rays.org_y[i] = from.y(), rays.org_z[i] = from.z();
    rays.dir_x[i] = direction.x(), rays.dir_y[i] = direction.y(), rays.dir_z[i] = direction.z();
    rays.tnear[i] = 0, rays.tfar[i] = reach, rays.time[i] = 0;
    rays.mask[i] = ~0u, rays.id[i] = 0, rays.flags[i] = 0;
  }

  Vector3f from_lamp(const Lamp& lamp, const Sample& sample) const {
    alignas(64) RTCRay16 rays;
    alignas(64) int valid[kRays];
    float received[kRays];
    const Vector3f lamp_normal = lamp.edge_a.cross(lamp.edge_b).normalized();
    const float area_m2 = lamp.edge_a.cross(lamp.edge_b).norm();
    for (int i = 0; i < kRays; ++i) {
      const float a = (static_cast<float>(i % 4) + 0.5f) / 4;
      const float b = (static_cast<float>(i / 4) + 0.125f + 0.25f * static_cast<float>(i % 4)) / 4;
      const Vector3f to_lamp = lamp.corner + a * lamp.edge_a + b * lamp.edge_b - sample.point;
      const float distance = to_lamp.norm();
      const float cosines = std::max(0.0f, sample.normal.dot(to_lamp) / distance) *
                            std::max(0.0f, -lamp_normal.dot(to_lamp) / distance);
      received[i] = cosines * area_m2 / (kRays * distance * distance);
      valid[i] = received[i] > 0 ? -1 : 0;
      set_ray(rays, i, sample.point, to_lamp, 0.97f);
    }
    tracer_.find_blocked(valid, &rays);
    float sum = 0;
    for (int i = 0; i < kRays; ++i) sum += rays.tfar[i] >= 0 ? received[i] : 0;
    return sum * lamp.radiance;
  }

  Vector3f ambient(const Sample& sample) const {
    alignas(64) RTCRay16 rays;
    alignas(64) int valid[kRays];
    const Eigen::Quaternionf turn =
        Eigen::Quaternionf::FromTwoVectors(Vector3f::UnitZ(), sample.normal);
    for (int i = 0; i < kRays; ++i) {
      valid[i] = -1;
      set_ray(rays, i, sample.point, turn * hemisphere_[i], params_.ambient_reach_m);
    }
    tracer_.find_blocked(valid, &rays);
    float open = 0;
    for (int i = 0; i < kRays; ++i) open += rays.tfar[i] >= 0 ? 1.0f / kRays : 0.15f / kRays;
    // White light from the ceiling, warmer and weaker light from the floor.
    const float up = 0.5f + 0.5f * sample.normal.z();
    const Vector3f tint =
        up * Vector3f(1.0f, 1.0f, 1.02f) + (1 - up) * Vector3f(0.62f, 0.55f, 0.48f);
    return params_.ambient * open * tint;
  }

  const Scene& scene_;
  const LightingParams& params_;
  RayTracer tracer_;
  std::array<Vector3f, kRays> hemisphere_;
};

// What is smaller than half a step gets one sample, in its middle.
int sample_count(float length_m, float step_m) {
  if (length_m < 0.5f * step_m) return 1;
  return std::clamp(static_cast<int>(std::ceil(length_m / step_m)) + 1, 2, 256);
}

Sample sample_of(const Surface& surface, float u, float v) {
  // Just inside the edges, out of the walls and boxes that touch there.
  const auto inset = [](float x) { return 0.005f + 0.99f * x; };
  const auto& c = surface.corners;
  const float a = inset(u), b = inset(v);
  const Vector3f normal = ((1 - a) * surface.normal_left + a * surface.normal_right).normalized();
  const Vector3f point = (1 - b) * ((1 - a) * c[0] + a * c[1]) + b * ((1 - a) * c[3] + a * c[2]);
  return {point + kLift_m * normal, normal};
}

// A 3×3 binomial filter hides the steps between the lamps' points.
std::vector<Vector3f> smoothed(const std::vector<Vector3f>& in, int width, int height) {
  std::vector<Vector3f> out(in.size());
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      Vector3f sum = Vector3f::Zero();
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          const int i = std::clamp(x + dx, 0, width - 1), j = std::clamp(y + dy, 0, height - 1);
          sum += static_cast<float>((2 - std::abs(dx)) * (2 - std::abs(dy))) / 16.0f *
                 in[static_cast<size_t>(j) * width + i];
        }
      }
      out[static_cast<size_t>(y) * width + x] = sum;
    }
  }
  return out;
}

TextureLevel light_map(const Baker& baker, const Surface& surface, float gamma) {
  const auto& c = surface.corners;
  const float step_m = surface.finish.light_step_m;
  const int width = sample_count(std::max((c[1] - c[0]).norm(), (c[2] - c[3]).norm()), step_m);
  const int height = sample_count(std::max((c[3] - c[0]).norm(), (c[2] - c[1]).norm()), step_m);
  const auto part = [](int i, int count) {
    return count > 1 ? static_cast<float>(i) / static_cast<float>(count - 1) : 0.5f;
  };
  std::vector<Vector3f> light;
  light.reserve(static_cast<size_t>(width) * height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      light.push_back(baker.light_at(sample_of(surface, part(x, width), part(y, height))));
    }
  }
  if (width > 4 && height > 4) light = smoothed(light, width, height);
  TextureLevel map{width, height, {}};
  map.texels.reserve(light.size());
  const auto level = [gamma](float x) { return 255 / kLightMapRange * std::pow(x, 1 / gamma); };
  for (const Vector3f& l : light) {
    map.texels.push_back(pack_texel(level(l.x()), level(l.y()), level(l.z())));
  }
  return map;
}

// The middle of each surface's largest triangle.
std::vector<Vector3f> middles_of_surfaces(const Scene& scene) {
  std::vector<Vector3f> middles(scene.surfaces.size(), Vector3f::Zero());
  std::vector<float> largest(scene.surfaces.size(), -1);
  for (const Triangle& triangle : scene.triangles) {
    const auto corner = [&](int i) { return scene.vertices[triangle.vertices[i]].point_in_world; };
    const float area = (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm();
    if (area <= largest[triangle.surface]) continue;
    largest[triangle.surface] = area;
    middles[triangle.surface] = (corner(0) + corner(1) + corner(2)) / 3;
  }
  return middles;
}

}  // namespace

void bake_lighting(Scene& scene, const LightingParams& params) {
  const Baker baker(scene, params);
  for (Surface& surface : scene.surfaces) {
    surface.light = light_map(baker, surface, params.gamma);
  }
}

void turn_to_light(Scene& scene, const LightingParams& params) {
  const Baker baker(scene, params);
  const std::vector<Vector3f> middles = middles_of_surfaces(scene);
  for (size_t i = 0; i < middles.size(); ++i) {
    Surface& surface = scene.surfaces[i];
    const auto light_on = [&](const Vector3f& normal) {
      return baker.light_at({middles[i] + kLift_m * normal, normal}).sum();
    };
    const Vector3f normal = (surface.normal_left + surface.normal_right).normalized();
    if (light_on(-normal) > 1.05f * light_on(normal)) {
      surface.normal_left = -surface.normal_left;
      surface.normal_right = -surface.normal_right;
    }
  }
}

}  // namespace foresight::sim
