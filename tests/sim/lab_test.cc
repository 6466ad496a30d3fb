#include "sim/lab.h"

#include <gtest/gtest.h>

#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <set>
#include <span>

#include "common/errors.h"
#include "common/fnv.h"
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
  Fnv1a hash;
  for (const Vertex& v : scene.vertices) {
    hash.add(std::span(v.point_in_world.data(), 3));
    hash.add(std::span(v.texture_uv.data(), 2));
  }
  for (const Triangle& t : scene.triangles) hash.add(t.vertices);
  for (const Texture& t : scene.textures) hash.add(t.levels[0].texels);
  for (const Surface& s : scene.surfaces) hash.add(s.light.texels);
  return hash.value();
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

TEST(Lab, RefusesPlacesAndLettersThatDoNotExist) {
  for (const char* letters : {"", "ABC", "ABCDEFA", "AACDEF", "abcdef", "ABCDEG"}) {
    EXPECT_THROW(make_lab({.letters = letters}), ConfigError) << letters;
  }
  for (const std::array<int, 2> places : {std::array{0, 0}, {-1, 2}, {0, kPanelPlaces}}) {
    EXPECT_THROW(make_lab({.panel_places = places}), ConfigError);
  }
}

// What a camera sees that faces the target squarely from this far.
Image view_of(RayCamera& camera, const Target& target, double distance_m) {
  const Pose<World, Face>& face = target.world_from_face;
  return camera.render({face.rotation(), face * Eigen::Vector3d(0, 0, -distance_m)}, 0);
}

int level_at(const Image& image, const Eigen::Vector2d& pixel, int channel) {
  const auto x = static_cast<size_t>(pixel.x() + 0.5), y = static_cast<size_t>(pixel.y() + 0.5);
  return image.bytes[3 * (y * static_cast<size_t>(image.width_px) + x) + channel];
}

TEST(Lab, CardsStandWhereTheTargetsSay) {
  const Scene scene = make_lab({.letters = " ABCD "});
  ASSERT_EQ(scene.targets.size(), 4u);
  RayCamera camera(scene, {.model = sequence_camera(320, false)});
  for (size_t i = 0; i < 4; ++i) {
    const Target& target = scene.targets[i];
    EXPECT_EQ(target.name, std::string(1, static_cast<char>('A' + i)));
    const double distance_m = 0.2;
    const Image image = view_of(camera, target, distance_m);
    // White just inside the printed frame in all four corners, but not beyond the card's edge.
    for (const double x : {-1, 1}) {
      for (const double y : {-1, 1}) {
        const Eigen::Vector3d offset(0.985 * x * target.width_m / 2,
                                     0.985 * y * target.height_m / 2, distance_m);
        EXPECT_GT(level_at(image, camera.model().project(offset), 2), 90) << target.name;
      }
    }
    const DepthImage depth =
        camera.render_depth({target.world_from_face.rotation(),
                             target.world_from_face * Eigen::Vector3d(0, 0, -distance_m)});
    EXPECT_NEAR(depth.depth_m[120 * 320 + 160], distance_m, 1e-3);
  }
}

TEST(Lab, LedsAreLitOneByOne) {
  const Scene scene = make_lab({.panel_places = {4, 2}, .leds_lit = {0b000000001, 0}});
  ASSERT_EQ(scene.led_panels.size(), 2u);
  RayCamera camera(scene, {.model = sequence_camera(320, false)});
  for (const LedPanel& panel : scene.led_panels) {
    const double distance_m = 0.15;
    const auto red_of = [&](int led) {
      const std::array<Eigen::Vector3f, 4>& c = scene.surfaces[panel.surfaces[led]].corners;
      const Pose<Face, World> face_from_world = panel.target.world_from_face.inverse();
      const Eigen::Vector3d in_face = face_from_world * ((c[0] + c[2]) / 2).cast<double>();
      EXPECT_NEAR(in_face.x(), 0.022 * (led % 3 - 1), 1e-4);
      EXPECT_NEAR(in_face.y(), 0.022 * (led / 3 - 1), 1e-4);
      const Image image = view_of(camera, panel.target, distance_m);
      return level_at(image, camera.model().project(in_face + Eigen::Vector3d(0, 0, distance_m)),
                      0);
    };
    for (int led = 0; led < 9; ++led) {
      const bool first = &panel == &scene.led_panels[0] && led == 0;
      if (!first) EXPECT_LT(red_of(led), 110) << panel.target.name << led;
      camera.light_led(panel, led, true);
      EXPECT_GT(red_of(led), 230) << panel.target.name << led;
      camera.light_led(panel, led, false);
      EXPECT_LT(red_of(led), 110) << panel.target.name << led;
    }
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
