#include "sim/lab.h"

#include <gtest/gtest.h>

#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "sim/ray_camera.h"
#include "sim/sequence.h"
#include "sim/trajectory.h"

namespace foresight::sim {
namespace {

const Scene& lab() {
  static const Scene scene = make_lab(1);
  return scene;
}

uint64_t hash(const Scene& scene) {
  uint64_t sum = 14695981039346656037u;
  const auto mix = [&sum](const void* data, size_t size) {
    const auto* bytes = static_cast<const uint8_t*>(data);
    for (size_t i = 0; i < size; ++i) sum = (sum ^ bytes[i]) * 1099511628211u;
  };
  for (const Vertex& v : scene.vertices) {
    mix(v.point_in_world.data(), sizeof(float) * 3);
    mix(v.texture_uv.data(), sizeof(float) * 2);
  }
  for (const Triangle& t : scene.triangles) mix(t.vertices.data(), sizeof(t.vertices));
  for (const Texture& t : scene.textures) {
    mix(t.levels[0].texels.data(), t.levels[0].texels.size() * sizeof(uint32_t));
  }
  for (const Surface& s : scene.surfaces) {
    mix(s.light.texels.data(), s.light.texels.size() * sizeof(uint32_t));
  }
  return sum;
}

TEST(Lab, IsTheSameForTheSameSeed) {
  EXPECT_EQ(hash(lab()), hash(make_lab(1)));
  EXPECT_NE(hash(lab()), hash(make_lab(2)));
}

TEST(Lab, IsWellFormed) {
  const auto vertex_count = static_cast<int>(lab().vertices.size());
  const auto surface_count = static_cast<int>(lab().surfaces.size());
  EXPECT_GT(surface_count, 500);
  for (const Triangle& triangle : lab().triangles) {
    ASSERT_GE(triangle.surface, 0);
    ASSERT_LT(triangle.surface, surface_count);
    for (const int v : triangle.vertices) {
      ASSERT_GE(v, 0);
      ASSERT_LT(v, vertex_count);
    }
  }
  for (const Vertex& v : lab().vertices) {
    ASSERT_TRUE(v.point_in_world.allFinite() && v.texture_uv.allFinite());
    ASSERT_GE(v.point_in_world.x(), kBackWall_m - 1e-4f);
    ASSERT_LE(v.point_in_world.x(), kFrontWall_m + 1e-4f);
    ASSERT_GE(v.point_in_world.z(), kFloor_m - 1e-3f);
    ASSERT_LE(v.point_in_world.z(), kCeiling_m + 1e-4f);
  }
  for (const Surface& surface : lab().surfaces) {
    ASSERT_GE(surface.finish.texture, 0);
    ASSERT_LT(surface.finish.texture, static_cast<int>(lab().textures.size()));
    ASSERT_EQ(surface.light.texels.size(),
              static_cast<size_t>(surface.light.width) * surface.light.height);
  }
}

TEST(Lab, HasTheThingsThatTasksNeed) {
  std::set<std::string> names;
  for (const Surface& surface : lab().surfaces) names.insert(surface.name);
  for (const char* name : {"letter_A.front", "letter_F.front", "led_0.top", "led_8.top",
                           "monitor.screen", "whiteboard.front", "desk.top", "wall.left"}) {
    EXPECT_TRUE(names.contains(name)) << name;
  }
}

// Mean level of a surface's light map.
double mean_light(const Surface& surface) {
  double sum = 0;
  for (const uint32_t texel : surface.light.texels) sum += (texel >> 8) & 0xFF;
  return sum / static_cast<double>(surface.light.texels.size());
}

TEST(Lab, LightFallsFromAbove) {
  double top = 0, bottom = 0;
  for (const Surface& surface : lab().surfaces) {
    if (surface.name == "desk.top") top = mean_light(surface);
    if (surface.name == "desk.bottom") bottom = mean_light(surface);
  }
  EXPECT_GT(top, 1.5 * bottom);
  EXPECT_GT(bottom, 20);
}

struct Corners {
  int count = 0;
  int cells_with_three = 0;  // of 8 × 6
};

Corners find_corners(Image& image) {
  const cv::Mat rgb(image.height_px, image.width_px, CV_8UC3, image.bytes.data());
  cv::Mat gray;
  cv::cvtColor(rgb, gray, cv::COLOR_RGB2GRAY);
  std::vector<cv::KeyPoint> points;
  cv::FAST(gray, points, 20);
  std::array<int, 48> cells{};
  for (const cv::KeyPoint& p : points) {
    ++cells[static_cast<size_t>(p.pt.x * 8 / static_cast<float>(image.width_px)) * 6 +
            static_cast<size_t>(p.pt.y * 6 / static_cast<float>(image.height_px))];
  }
  Corners corners{static_cast<int>(points.size()), 0};
  for (const int n : cells) corners.cells_with_three += n >= 3 ? 1 : 0;
  return corners;
}

TEST(Lab, GivesATrackerEnoughCorners) {
  RayCamera camera(lab(), {.model = sequence_camera(640, false), .noise_levels = 1.5});
  for (const Trajectory::Kind kind : {Trajectory::Kind::kDesk, Trajectory::Kind::kRotation}) {
    const Trajectory trajectory(kind, 1);
    for (int i = 0; i < 8; ++i) {
      Image image = camera.render(trajectory.at(seconds(2.5 * i)), static_cast<uint64_t>(i));
      const Corners corners = find_corners(image);
      EXPECT_GE(corners.count, 300) << "frame " << i;
      EXPECT_GE(corners.cells_with_three, 28) << "frame " << i;
    }
  }
}

TEST(Lab, HasPlainWallsToo) {
  RayCamera camera(lab(), {.model = sequence_camera(320, false)});
  Eigen::Matrix3d right_wall;  // x forward is −y
  right_wall.col(0) = -Eigen::Vector3d::UnitX();
  right_wall.col(1) = -Eigen::Vector3d::UnitZ();
  right_wall.col(2) = -Eigen::Vector3d::UnitY();
  Image image = camera.render({right_wall, Eigen::Vector3d(-1.2, 0, 0.5)}, 0);
  EXPECT_LT(find_corners(image).cells_with_three, 12);
}

}  // namespace
}  // namespace foresight::sim
