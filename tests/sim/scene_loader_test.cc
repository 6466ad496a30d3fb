#include "sim/scene_loader.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "common/errors.h"
#include "sim/lab.h"
#include "sim/random.h"
#include "sim/ray_camera.h"
#include "sim/sequence.h"
#include "sim/trajectory.h"

namespace foresight::sim {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using Eigen::Vector3f;

const LoadOptions kAsItIs{
    .up = LoadOptions::Up::kZ, .world_from_file = Pose<World, SceneFile>(), .bake = false};

// The vertices and faces of an OBJ file, box by box.
class ObjText {
 public:
  // Six quadrilaterals that look outwards; `inside_out` turns them round.
  void add_box(const Vector3d& low, const Vector3d& high, bool inside_out = false) {
    for (int i = 0; i < 8; ++i) {
      text_ << "v " << ((i & 1) ? high : low).x() << ' ' << ((i & 2) ? high : low).y() << ' '
            << ((i & 4) ? high : low).z() << '\n';
    }
    const int faces[6][4] = {{1, 3, 4, 2}, {5, 6, 8, 7}, {1, 2, 6, 5},
                             {3, 7, 8, 4}, {1, 5, 7, 3}, {2, 4, 8, 6}};
    for (const auto& face : faces) {
      text_ << 'f';
      for (int i = 0; i < 4; ++i) {
        text_ << ' ' << vertices_ + face[inside_out ? 3 - i : i] << '/' << i + 1;
      }
      text_ << '\n';
    }
    vertices_ += 8;
  }
  void use(const std::string& material) { text_ << "usemtl " << material << '\n'; }
  std::string text() const {
    return "mtllib scene.mtl\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n" + text_.str();
  }

 private:
  std::ostringstream text_;
  int vertices_ = 0;
};

class SceneLoader : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) /
              (std::string("scene_loader_") + info->name() + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string write(const std::string& name, const std::string& content) {
    std::ofstream(folder_ / name, std::ios::binary) << content;
    return (folder_ / name).string();
  }
  void write_picture(const std::string& name, const cv::Mat& bgr) {
    ASSERT_TRUE(cv::imwrite((folder_ / name).string(), bgr));
  }
  // The error's line; empty when there is none of type E.
  template <class E>
  static std::string error(const std::string& path, const LoadOptions& options = {}) {
    try {
      load_scene(path, options);
    } catch (const E& e) {
      return e.what();
    }
    return "";
  }
  static bool one_line_with(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos && text.find('\n') == std::string::npos;
  }
  // A room of 6 × 5 m with a checkered table, a floor, walls and a ceiling, z or y up.
  std::string write_room(bool y_up) {
    cv::Mat checkers(64, 64, CV_8UC3);
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) {
        checkers.at<cv::Vec3b>(y, x) = cv::Vec3b::all((x / 8 + y / 8) % 2 ? 230 : 40);
      }
    }
    write_picture("checkers.png", checkers);
    write("scene.mtl", "newmtl grey\nKd 0.6 0.6 0.6\nnewmtl checkers\nmap_Kd checkers.png\n");
    const auto turned = [y_up](double x, double y, double z) {
      return y_up ? Vector3d(x, z, -y) : Vector3d(x, y, z);
    };
    ObjText obj;
    const auto box = [&](const Vector3d& a, const Vector3d& b) {
      const Vector3d p = turned(a.x(), a.y(), a.z()), q = turned(b.x(), b.y(), b.z());
      obj.add_box(p.cwiseMin(q), p.cwiseMax(q));
    };
    obj.use("grey");
    box({10, 20, 4.9}, {16, 25, 5});    // the floor's top is at 5
    box({10, 20, 7.5}, {16, 25, 7.6});  // ceiling
    box({9.9, 20, 5}, {10, 25, 7.5}), box({16, 20, 5}, {16.1, 25, 7.5});
    box({10, 19.9, 5}, {16, 20, 7.5}), box({10, 25, 5}, {16, 25.1, 7.5});
    obj.use("checkers");
    box({14, 21.5, 5}, {15, 23.5, 5.75});
    return write(y_up ? "y.obj" : "z.obj", obj.text());
  }

  fs::path folder_;
};

// 0 … 1: mean level of the light that a surface's map holds.
double light(const Surface& surface) {
  double sum = 0;
  for (const uint32_t texel : surface.light.texels) sum += (texel >> 8) & 0xFF;
  return sum / 255 / static_cast<double>(surface.light.texels.size());
}

TEST_F(SceneLoader, ShowsATextureTheRightWayRound) {
  cv::Mat quarters(2, 2, CV_8UC3);  // blue, green, red in OpenCV's order
  quarters.at<cv::Vec3b>(0, 0) = {0, 0, 250};
  quarters.at<cv::Vec3b>(0, 1) = {0, 250, 0};
  quarters.at<cv::Vec3b>(1, 0) = {250, 0, 0};
  quarters.at<cv::Vec3b>(1, 1) = {250, 250, 250};
  cv::resize(quarters, quarters, {64, 64}, 0, 0, cv::INTER_NEAREST);
  write_picture("quarters.png", quarters);
  write("scene.mtl", "newmtl m\nKd 1 1 1\nmap_Kd quarters.png\n");
  // A wall at x = 2 that faces −x: its lower left corner, for its viewer, is at y = 1.
  const std::string path = write("wall.obj",
                                 "mtllib scene.mtl\nusemtl m\nv 2 1 -1\nv 2 -1 -1\nv 2 -1 1\n"
                                 "v 2 1 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n");
  LoadReport report;
  const Scene scene = load_scene(path, kAsItIs, &report);
  EXPECT_EQ(report.triangles, 2);
  EXPECT_EQ(report.textures, 1);
  EXPECT_TRUE(report.warnings.empty());
  RayCamera camera(scene, {.model = sequence_camera(160, false), .vignetting = 0});
  Eigen::Matrix3d looking_along_x;
  looking_along_x << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const Image image = camera.render({looking_along_x, Vector3d::Zero()}, 0);
  // Red, green and blue as bits.
  const auto colour = [&](int x, int y) {
    const uint8_t* p = &image.bytes[3 * (static_cast<size_t>(y) * 160 + x)];
    return (p[0] > 245) + 2 * (p[1] > 245) + 4 * (p[2] > 245);
  };
  EXPECT_EQ(colour(60, 40), 1);
  EXPECT_EQ(colour(100, 40), 2);
  EXPECT_EQ(colour(60, 80), 4);
  EXPECT_EQ(colour(100, 80), 7);
}

TEST_F(SceneLoader, MissingTexturesAreCountedAndGetTheirColour) {
  write("scene.mtl",
        "newmtl m\nKd 0.2 0.4 0.8\nmap_Kd nowhere.png\n"
        "newmtl n\nmap_Kd broken.png\n");
  write("broken.png", "this is no picture");
  ObjText obj;
  obj.use("m");
  obj.add_box({0, 0, 0}, {1, 1, 1});
  obj.use("n");
  obj.add_box({2, 0, 0}, {3, 1, 1});
  LoadReport report;
  const Scene scene = load_scene(write("box.obj", obj.text()), kAsItIs, &report);
  EXPECT_EQ(report.textures, 0);
  EXPECT_EQ(report.missing_textures, 2);
  ASSERT_EQ(report.warnings.size(), 2u);
  EXPECT_TRUE(one_line_with(report.warnings[0] + report.warnings[1], "nowhere.png"));
  EXPECT_TRUE(one_line_with(report.warnings[0] + report.warnings[1], "broken.png"));
  const Texture& texture = scene.textures[scene.surfaces[0].finish.texture];
  EXPECT_EQ(texture.levels[0].texels[0], pack_texel(51, 102, 204));
}

TEST_F(SceneLoader, ShrinksLargeTextures) {
  write_picture("large.png", cv::Mat(500, 3000, CV_8UC3, cv::Scalar(1, 2, 3)));
  write("scene.mtl", "newmtl m\nmap_Kd large.png\n");
  ObjText obj;
  obj.use("m");
  obj.add_box({0, 0, 0}, {1, 1, 1});
  const std::string path = write("box.obj", obj.text());
  for (const int side : {2048, 64}) {
    LoadOptions options = kAsItIs;
    options.max_texture_px = side;
    for (const Texture& texture : load_scene(path, options).textures) {
      EXPECT_LE(texture.levels[0].width, side);
      EXPECT_LE(texture.levels[0].height, side);
    }
  }
}

TEST_F(SceneLoader, SaysInOneLineWhatIsWrong) {
  const std::string nowhere = (folder_ / "nowhere.obj").string();
  EXPECT_TRUE(one_line_with(error<UnavailableError>(nowhere), nowhere));
  fs::create_directories(folder_ / "folder.obj");
  EXPECT_TRUE(one_line_with(error<UnavailableError>((folder_ / "folder.obj").string()), "no such"));
  EXPECT_TRUE(one_line_with(error<ConfigError>(write("room.txt", "hello")), ".glb"));
  const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  for (const auto& [name, content] : std::vector<std::pair<std::string, std::string>>{
           {"empty.obj", ""},
           {"prose.obj", "It was a dark and stormy night.\n"},
           {"points.obj", triangle},
           {"lines.obj", triangle + "l 1 2\nl 2 3\n"},
           {"index.obj", triangle + "f 1 2 999999999\n"},
           {"zero.obj", triangle + "f 0 1 2\n"},
           {"flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"},
           {"nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"},
           {"far.obj", "v 1e30 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"},
           {"no.gltf", "{}"},
           {"json.gltf", "not json"},
           {"short.glb", "glTF"},
           {"noise.glb", std::string(1000, '\x7f')}}) {
    const std::string path = write(name, content);
    EXPECT_TRUE(one_line_with(error<ConfigError>(path), path)) << name;
  }
}

TEST_F(SceneLoader, RefusesOptionsThatMakeNoSense) {
  const std::string path = write_room(false);
  for (const double scale : {0.0, -1.0, std::nan(""), 1e9}) {
    EXPECT_TRUE(one_line_with(error<ConfigError>(path, {.scale = scale}), "scale"));
  }
  EXPECT_TRUE(one_line_with(error<ConfigError>(path, {.max_texture_px = 0}), "max_texture_px"));
  const Pose<World, SceneFile> lost(Eigen::Quaterniond::Identity(), Vector3d(std::nan(""), 0, 0));
  EXPECT_TRUE(one_line_with(error<ConfigError>(path, {.world_from_file = lost}), "finite"));
}

TEST_F(SceneLoader, BrokenFilesNeverCrash) {
  const std::string good = [this] {
    std::ifstream in(write_room(false), std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  }();
  Random random(1, "fuzz");
  for (int round = 0; round < 150; ++round) {
    std::string bad = good;
    for (int i = 0; i < 1 + round % 12; ++i) {
      bad[static_cast<size_t>(random.below(static_cast<int>(bad.size())))] =
          static_cast<char>(random.below(256));
    }
    if (round % 5 == 0) bad.resize(static_cast<size_t>(random.below(static_cast<int>(bad.size()))));
    try {
      load_scene(write("fuzz.obj", bad), kAsItIs);
    } catch (const StartupError&) {
    }
  }
}

// Scenes turn up in the world as they were meant, with the arm at the origin.
TEST_F(SceneLoader, PutsTheFloorBelowTheArmAndSomethingBeforeIt) {
  for (const bool y_up : {false, true}) {
    LoadReport report;
    const Scene scene = load_scene(write_room(y_up), {.bake = false}, &report);
    EXPECT_EQ(report.triangles, 7 * 12) << y_up;
    RayCamera camera(scene, {.model = sequence_camera(160, false)});
    Eigen::Matrix3d looking_down;
    looking_down << 0, -1, 0, -1, 0, 0, 0, 0, -1;
    EXPECT_NEAR(camera.render_depth({looking_down, Vector3d::Zero()}).depth_m[60 * 160 + 80],
                -kFloor_m, 0.02);
    Eigen::Matrix3d ahead;  // the table, 20° down
    const double down = 0.35;
    ahead << 0, -std::sin(down), std::cos(down), -1, 0, 0, 0, -std::cos(down), -std::sin(down);
    const DepthImage depth = camera.render_depth({ahead, Vector3d(0.25, 0, 0.35)});
    int near = 0;
    for (const float d : depth.depth_m) near += d > 0.5f && d < 3.0f;
    EXPECT_GT(near, 160 * 120 / 3);
    EXPECT_GT(report.world_from_file.translation().norm(), 5);
  }
}

TEST_F(SceneLoader, ScaleAndPoseAreAsAsked) {
  ObjText obj;
  obj.add_box({0, 0, 0}, {100, 200, 300});
  const std::string path = write("box.obj", obj.text());
  LoadOptions options = kAsItIs;
  options.scale = 0.01;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(M_PI / 2, Vector3d::UnitZ()));
  options.world_from_file = Pose<World, SceneFile>(turn, {1, 0, 0});
  Vector3f low = Vector3f::Constant(1e9f), high = -low;
  const Scene scene = load_scene(path, options);
  for (const Triangle& triangle : scene.triangles) {
    if (scene.surfaces[triangle.surface].name == "backdrop") continue;
    for (const int v : triangle.vertices) {
      low = low.cwiseMin(scene.vertices[v].point_in_world);
      high = high.cwiseMax(scene.vertices[v].point_in_world);
    }
  }
  EXPECT_LT((low - Vector3f(-1, 0, 0)).norm(), 1e-5);
  EXPECT_LT((high - Vector3f(1, 1, 3)).norm(), 1e-5);
}

TEST_F(SceneLoader, GltfIsYUpAndItsNodesHavePoses) {
  // One triangle (0,0,0) (1,0,0) (0,1,0); indices 0 1 2 as 16-bit numbers, then the points.
  const std::string data = "AAABAAIAAAAAAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAAAAAACAPwAAAAA=";
  const std::string path = write("node.gltf", R"({"asset": {"version": "2.0"}, "scene": 0,
    "scenes": [{"nodes": [0]}], "nodes": [{"children": [1], "translation": [10, 0, 0]},
      {"mesh": 0, "translation": [0, 5, 0], "scale": [2, 2, 2]}],
    "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0.2, 1]}}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 1}, "indices": 0, "material": 0}]}],
    "buffers": [{"byteLength": 44, "uri": "data:application/octet-stream;base64,)" +
                                                  data + R"("}],
    "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 6},
      {"buffer": 0, "byteOffset": 8, "byteLength": 36}],
    "accessors": [{"bufferView": 0, "componentType": 5123, "count": 3, "type": "SCALAR"},
      {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC3",
       "min": [0, 0, 0], "max": [1, 1, 0]}]})");
  LoadOptions options = kAsItIs;
  options.up = LoadOptions::Up::kAuto;
  const Scene scene = load_scene(path, options);
  const Triangle& triangle = scene.triangles[0];
  const auto corner = [&](size_t i) { return scene.vertices[triangle.vertices[i]].point_in_world; };
  EXPECT_LT((corner(0) - Vector3f(10, 0, 5)).norm(), 1e-4);
  EXPECT_LT((corner(1) - Vector3f(12, 0, 5)).norm(), 1e-4);
  EXPECT_LT((corner(2) - Vector3f(10, 0, 7)).norm(), 1e-4);
  const uint32_t texel =
      scene.textures[scene.surfaces[triangle.surface].finish.texture].levels[0].texels[0];
  EXPECT_EQ(texel & 0xFFFF, 255u);
  EXPECT_NEAR(texel >> 16, 255 * std::pow(0.2, 1 / 2.2), 1);
}

TEST_F(SceneLoader, LightFallsFromAboveWhicheverWayTheTrianglesLook) {
  double top[2], bottom[2];
  for (const bool inside_out : {false, true}) {
    ObjText obj;
    obj.add_box({-4, -4, -0.1}, {4, 4, 0}, inside_out);
    obj.add_box({-0.5, -0.5, 0.7}, {0.5, 0.5, 0.75}, inside_out);
    const Scene scene = load_scene(write("table.obj", obj.text()),
                                   {.up = LoadOptions::Up::kZ,
                                    .world_from_file = Pose<World, SceneFile>(
                                        Eigen::Quaterniond::Identity(), {0, 0, kFloor_m})});
    for (const Surface& surface : scene.surfaces) {
      if (surface.corners[0].head<2>().norm() > 1) continue;
      const float z = surface.corners[0].z() - kFloor_m;
      const bool level = std::abs(surface.corners[2].z() - surface.corners[0].z()) < 0.01f;
      if (level && z > 0.74f) top[inside_out] = light(surface);
      if (level && z < 0.74f) bottom[inside_out] = light(surface);
    }
  }
  EXPECT_GT(top[0], 1.3 * bottom[0]);
  EXPECT_NEAR(top[1], top[0], 0.02);
  EXPECT_GT(top[0], 0.5);
}

TEST_F(SceneLoader, FlatPiecesAreOneSurfaceAndLoadTheSameAgain) {
  const std::string path = write_room(false);
  const Scene one = load_scene(path), two = load_scene(path);
  EXPECT_EQ(one.surfaces.size(), 7u * 6 + 6);  // boxes, backdrop
  ASSERT_EQ(one.vertices.size(), two.vertices.size());
  for (size_t i = 0; i < one.vertices.size(); ++i) {
    ASSERT_EQ(one.vertices[i].point_in_world, two.vertices[i].point_in_world);
    for (const float c : {one.vertices[i].light_uv.x(), one.vertices[i].light_uv.y()}) {
      ASSERT_TRUE(c >= 0 && c <= 1);
    }
  }
  for (size_t i = 0; i < one.surfaces.size(); ++i) {
    ASSERT_EQ(one.surfaces[i].light.texels, two.surfaces[i].light.texels);
  }
}

class RecordedScene : public testing::TestWithParam<std::pair<const char*, int>> {};

TEST_P(RecordedScene, LoadsAndHasMuchToSee) {
  const auto& [name, triangles] = GetParam();
  const char* data = std::getenv("FORESIGHT_DATA");
  const fs::path file =
      fs::path(data != nullptr ? data : FORESIGHT_DATA_DEFAULT) / "scenes" / name / "scene.obj";
  if (!fs::exists(file)) {
    GTEST_SKIP() << file << " is missing: set FORESIGHT_DATA to the folder that has scenes/";
  }
  LoadReport report;
  const Scene scene = load_scene(file.string(), {}, &report);
  EXPECT_EQ(report.triangles + report.left_out, triangles);
  EXPECT_LT(report.left_out, 20);
  EXPECT_EQ(report.missing_textures, 0);
  EXPECT_GT(report.textures, 20);
  RayCamera camera(scene, {.model = sequence_camera(320, false)});
  const Trajectory trajectory(Trajectory::Kind::kDesk, 1);
  for (int i = 0; i < 5; ++i) {
    const Image image = camera.render(trajectory.at(seconds(3.0 * i)), 0);
    int edges = 0;
    for (size_t p = 0; p + 4 < image.bytes.size(); p += 3) {
      edges += std::abs(image.bytes[p + 1] - image.bytes[p + 4]) > 25;
    }
    EXPECT_GT(edges, 320 * 240 / 60) << "frame " << i;
  }
}
INSTANTIATE_TEST_SUITE_P(Amazon, RecordedScene,
                         testing::Values(std::pair("aws_bookstore", 117305),
                                         std::pair("aws_small_warehouse", 13575)));

}  // namespace
}  // namespace foresight::sim
