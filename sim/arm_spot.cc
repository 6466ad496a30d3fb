#include "sim/arm_spot.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include "sim/lab.h"
#include "sim/ray_camera.h"
#include "sim/ray_tracer.h"

namespace foresight::sim {
namespace {

using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;

float radians(float degrees) { return degrees * kPi / 180; }

struct Bounds {
  Vector3f low, high;
};

// Of the triangles' middles, without the outermost 1 % on each side: stray things count little.
Bounds bounds_of(const std::vector<LoadedMesh>& meshes) {
  Bounds bounds;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<float> middles;
    for (const LoadedMesh& mesh : meshes) {
      for (const LoadedTriangle& t : mesh.triangles) {
        middles.push_back((t.points[0][axis] + t.points[1][axis] + t.points[2][axis]) / 3);
      }
    }
    std::sort(middles.begin(), middles.end());
    bounds.low[axis] = middles[middles.size() / 100];
    bounds.high[axis] = middles[middles.size() - 1 - middles.size() / 100];
  }
  return bounds;
}

// The largest level area across the axis in the lower half: where, and how large.
struct Level {
  float height = 0, area_m2 = 0;
};

Level largest_level(const std::vector<LoadedMesh>& meshes, const Bounds& bounds, int axis) {
  constexpr float kBin_m = 0.02f, kLevel = 0.98f;
  const float middle = (bounds.low[axis] + bounds.high[axis]) / 2;
  std::map<int, float> area_of_bin;
  for (const LoadedMesh& mesh : meshes) {
    for (const LoadedTriangle& t : mesh.triangles) {
      const float height = t.points[0][axis];
      if (height > middle || std::abs(height) > 1e6f || std::abs(t.normal()[axis]) < kLevel)
        continue;
      area_of_bin[static_cast<int>(std::floor(height / kBin_m))] += t.area_m2();
    }
  }
  Level best{bounds.low[axis], 0};
  for (const auto& [bin, area_m2] : area_of_bin) {
    if (area_m2 > best.area_m2) best = {(static_cast<float>(bin) + 0.5f) * kBin_m, area_m2};
  }
  return best;
}

// Whether a person-sized column around the shoulder is free and stands on the floor.
bool is_free(const RayTracer& probe, const Vector3f& shoulder, float shoulder_m) {
  constexpr float kRadius_m = 0.6f;
  const auto below = probe.distance(shoulder, -Vector3f::UnitZ());
  if (!below || std::abs(*below - shoulder_m) > 0.06f) return false;
  const auto above = probe.distance(shoulder, Vector3f::UnitZ());
  if (above && *above < 1.0f) return false;
  for (const float share : {0.15f, 0.6f, 1.0f, 1.5f}) {
    const Vector3f from = shoulder + Vector3f(0, 0, shoulder_m * (share - 1));
    for (int i = 0; i < 16; ++i) {
      const float angle = kPi / 8 * static_cast<float>(i);
      const auto clear = probe.distance(from, Vector3f(std::cos(angle), std::sin(angle), 0));
      if (clear && *clear < kRadius_m) return false;
    }
  }
  return true;
}

// A camera in the hand of an arm at the spot.
Pose<World, Cam> hand_camera(const Frame& spot) {
  const float down = radians(20);
  Eigen::Matrix3f spot_from_cam;  // columns: right, down, forward
  spot_from_cam << 0, -std::sin(down), std::cos(down), -1, 0, 0, 0, -std::cos(down),
      -std::sin(down);
  const Eigen::Matrix3f rotation = spot.linear() * spot_from_cam;
  const Vector3f position = spot * Vector3f(0.25f, 0, 0.35f);
  return {Eigen::Matrix3d(rotation.cast<double>()), position.cast<double>()};
}

CameraModel thumbnail_camera() {
  CameraModel model;
  model.width_px = 64;
  model.height_px = 48;
  model.fx_px = model.fy_px = 52;
  model.cx_px = 31.5;
  model.cy_px = 23.5;
  model.prepare();
  return model;
}

// How much texture and how many edges the hand's camera would see, at many distances that an arm's
// camera is good for rather than at one; less what is in its way.
float view_score(RayCamera& camera, const Frame& spot) {
  constexpr float kTooNear_m = 0.5f, kFar_m = 4.0f, kBin_m = 0.35f;
  const Pose<World, Cam> pose = hand_camera(spot);
  const DepthImage depth = camera.render_depth(pose);
  const Image image = camera.render(pose, 0);
  std::array<float, 12> contrasts{};
  float too_near = 0;
  for (int y = 0; y + 1 < image.height_px; ++y) {
    for (int x = 0; x + 1 < image.width_px; ++x) {
      const int i = y * image.width_px + x;
      const auto green = [&](int pixel) { return int{image.bytes[3 * pixel + 1]}; };
      const float depth_m = depth.depth_m[i];
      if (depth_m <= 0 || depth_m >= kFar_m) continue;
      if (depth_m < kTooNear_m) ++too_near;
      const int contrast =
          std::abs(green(i + 1) - green(i)) + std::abs(green(i + image.width_px) - green(i));
      if (contrast > 24) ++contrasts[static_cast<size_t>(depth_m / kBin_m)];
    }
  }
  float score = -0.15f * too_near;
  for (const float count : contrasts) score += std::sqrt(count);
  return score;
}

// Height of the ceiling over most of the room, where there is one.
std::optional<float> ceiling_m(const RayTracer& probe, const Bounds& bounds) {
  constexpr int kGrid = 12;
  std::vector<float> heights;
  for (int i = 0; i < kGrid * kGrid; ++i) {
    const float a = (static_cast<float>(i % kGrid) + 0.5f) / kGrid;
    const float b = (static_cast<float>(i / kGrid) + 0.5f) / kGrid;
    const Vector3f from(bounds.low.x() + a * (bounds.high.x() - bounds.low.x()),
                        bounds.low.y() + b * (bounds.high.y() - bounds.low.y()),
                        bounds.low.z() + 0.6f * (bounds.high.z() - bounds.low.z()));
    if (const auto above = probe.distance(from, Vector3f::UnitZ())) {
      heights.push_back(from.z() + *above);
    }
  }
  if (heights.size() < kGrid * kGrid * 6 / 10) return std::nullopt;
  std::nth_element(heights.begin(), heights.begin() + heights.size() / 2, heights.end());
  return heights[heights.size() / 2];
}

Bounds bounds_of(const Scene& scene) {
  Bounds bounds{scene.vertices[0].point_in_world, scene.vertices[0].point_in_world};
  for (const Vertex& v : scene.vertices) {
    bounds.low = bounds.low.cwiseMin(v.point_in_world);
    bounds.high = bounds.high.cwiseMax(v.point_in_world);
  }
  return bounds;
}

// Light that the lamp gives an upward-facing surface below its middle, per radiance.
float light_below(const Lamp& lamp, float distance_m) {
  constexpr int kGrid = 8;
  const Vector3f middle = 0.5f * (lamp.edge_a + lamp.edge_b);
  const float area_m2 = lamp.edge_a.cross(lamp.edge_b).norm();
  float sum = 0;
  for (int i = 0; i < kGrid * kGrid; ++i) {
    const float a = (static_cast<float>(i % kGrid) + 0.5f) / kGrid;
    const float b = (static_cast<float>(i / kGrid) + 0.5f) / kGrid;
    const float across2 = (a * lamp.edge_a + b * lamp.edge_b - middle).squaredNorm();
    const float squared = across2 + distance_m * distance_m;
    sum += distance_m * distance_m / (squared * squared);
  }
  return sum * area_m2 / (kGrid * kGrid);
}

void add_backdrop(Scene& scene, const Bounds& b) {
  const float margin = 2 + 0.2f * (b.high - b.low).norm();
  const Vector3f l = b.low - Vector3f(margin, margin, 0.5f);
  const Vector3f h = b.high + Vector3f::Constant(margin);
  const cv::Mat pale(2, 2, CV_8UC3, cv::Scalar(196, 204, 212));
  const Finish finish{scene.add_texture(make_texture(pale, true)), 1, 1, 1e6f};
  const auto wall = [&](const Vector3f& from, const Vector3f& along) {
    const Vector3f up(0, 0, h.z() - l.z());
    add_quad(scene, "backdrop", {from + up, from + along + up, from + along, from}, finish);
  };
  const Vector3f x(h.x() - l.x(), 0, 0), y(0, h.y() - l.y(), 0);
  wall(l, y), wall(l + x, y), wall(l, x), wall(l + y, x);
  for (const float z : {l.z(), h.z()}) {
    const Vector3f from(l.x(), l.y(), z);
    add_quad(scene, "backdrop", {from, from + x, from + x + y, from + y}, finish);
  }
}

}  // namespace

bool y_is_up(const std::vector<LoadedMesh>& meshes) {
  const Bounds bounds = bounds_of(meshes);
  return largest_level(meshes, bounds, 1).area_m2 > 1.2f * largest_level(meshes, bounds, 2).area_m2;
}

float floor_height_m(const std::vector<LoadedMesh>& meshes) {
  return largest_level(meshes, bounds_of(meshes), 2).height;
}

Frame find_arm_spot(const Scene& scene, float floor_m, float floor_to_shoulder_m) {
  constexpr int kGrid = 20, kTurns = 12;
  const RayTracer probe(scene);
  RayCamera camera(scene, {.model = thumbnail_camera(), .antialiasing = Antialiasing::kNone});
  const Bounds bounds = bounds_of(scene);
  const Vector3f size = bounds.high - bounds.low;
  const float height = floor_m + floor_to_shoulder_m;
  Frame best = at(bounds.low.x() - 0.8f, bounds.low.y() + size.y() / 2, height);
  float best_score = 0;
  for (int i = 0; i < kGrid * kGrid; ++i) {
    const float x = bounds.low.x() + size.x() * (static_cast<float>(i % kGrid) + 0.5f) / kGrid;
    const float y = bounds.low.y() + size.y() * (static_cast<float>(i / kGrid) + 0.5f) / kGrid;
    if (!is_free(probe, {x, y, height}, floor_to_shoulder_m)) continue;
    for (int turn = 0; turn < kTurns; ++turn) {
      const Frame spot = at(x, y, height, 2 * kPi * static_cast<float>(turn) / kTurns);
      const float score = view_score(camera, spot);
      if (score > best_score) best_score = score, best = spot;
    }
  }
  return best;
}

void add_lamp_and_backdrop(Scene& scene) {
  constexpr float kDeskHeight_m = 0.8f, kLight = 0.95f;
  const Bounds bounds = bounds_of(scene);
  const std::optional<float> ceiling = ceiling_m(RayTracer(scene), bounds);
  const float top = ceiling ? *ceiling - 0.05f : bounds.high.z() + 0.5f;
  const Vector3f size = (bounds.high - bounds.low).cwiseMax(1.0f);
  // Not in the middle, so that opposite walls differ.
  Lamp lamp{{bounds.low.x() + 0.15f * size.x(), bounds.low.y() + 0.25f * size.y(), top},
            {0, 0.7f * size.y(), 0},
            {0.7f * size.x(), 0, 0},
            {1.0f, 0.96f, 0.89f}};
  lamp.radiance *= kLight / light_below(lamp, std::max(top - kFloor_m - kDeskHeight_m, 0.5f));
  scene.lamps.push_back(lamp);
  add_backdrop(scene, bounds);
}

}  // namespace foresight::sim
