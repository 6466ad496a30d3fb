#include "tests/renderer/test_scene.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <opencv2/imgcodecs.hpp>

namespace foresight {
namespace {

using Eigen::Vector3d;

const Vector3d kRoomLow(-3, -2, -2), kRoomHigh(3, 2, 5);
const Vector3d kBoxLow(-0.5, -0.6, 2.0), kBoxHigh(0.5, 0.6, 2.6);

/// Distance along a ray to the inside of the room.
double room_distance(const Vector3d& from, const Vector3d& way) {
  double nearest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    if (way[k] == 0) continue;
    nearest = std::min(nearest, ((way[k] > 0 ? kRoomHigh[k] : kRoomLow[k]) - from[k]) / way[k]);
  }
  return nearest;
}

/// Distance to the outside of the box; infinite on a miss.
double box_distance(const Vector3d& from, const Vector3d& way) {
  double enter = 0, leave = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const double a = (kBoxLow[k] - from[k]) / way[k], b = (kBoxHigh[k] - from[k]) / way[k];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter > 0 && enter < leave ? enter : std::numeric_limits<double>::infinity();
}

/// A pattern without repetition inside the room, smooth at the scale of a pixel.
double pattern(const Vector3d& p) {
  return 0.5 + 0.2 * std::sin(5 * p.x() + 2 * p.y() + p.z()) +
         0.2 * std::sin(4 * p.y() - 3 * p.z() + 0.7) + 0.1 * std::sin(9 * p.x() + 7 * p.z());
}

Vector3d colour_at(const Vector3d& point, bool on_box) {
  const double t = pattern(point);
  if (on_box) return {180 + 70 * t, 40 + 60 * t, 50};
  return {70 * t, 60 + 180 * t, 220 - 170 * pattern(1.3 * point + Vector3d(1, 2, 3))};
}

/// Adds a grid of cells over the rectangle corner, corner + a, corner + b.
void add_rectangle(Mesh* mesh, const Vector3d& corner, const Vector3d& a, const Vector3d& b,
                   int n) {
  const auto first = static_cast<int32_t>(mesh->vertices_in_map.size());
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; j <= n; ++j) {
      const Vector3d p =
          corner + a * (static_cast<double>(i) / n) + b * (static_cast<double>(j) / n);
      mesh->vertices_in_map.push_back(p.cast<float>());
      mesh->vertex_ids.emplace_back(static_cast<int32_t>(mesh->vertex_ids.size()));
      mesh->confidences.push_back(1);
    }
  }
  for (int32_t i = 0; i < n; ++i) {
    for (int32_t j = 0; j < n; ++j) {
      const int32_t v = first + i * (n + 1) + j;
      mesh->triangles.push_back({v, v + n + 1, v + 1});
      mesh->triangles.push_back({v + 1, v + n + 1, v + n + 2});
    }
  }
}

/// Six sides; the normals point into the cuboid when `inside`.
void add_cuboid(Mesh* mesh, const Vector3d& low, const Vector3d& high, bool inside, int n) {
  const Vector3d size = high - low;
  for (int k = 0; k < 3; ++k) {
    Vector3d a = Vector3d::Zero(), b = Vector3d::Zero(), c = Vector3d::Zero();
    a[(k + 1) % 3] = size[(k + 1) % 3];
    b[(k + 2) % 3] = size[(k + 2) % 3];
    c[k] = size[k];
    add_rectangle(mesh, low, inside ? a : b, inside ? b : a, n);
    add_rectangle(mesh, low + c, inside ? b : a, inside ? a : b, n);
  }
}

CameraModel base_camera() {
  CameraModel camera;
  camera.width_px = 320;
  camera.height_px = 240;
  camera.fx_px = 260;
  camera.fy_px = 262;
  camera.cx_px = 161.3;
  camera.cy_px = 118.2;
  return camera;
}

}  // namespace

Mesh TestScene::mesh(int cells_per_side) const {
  Mesh mesh;
  add_cuboid(&mesh, kRoomLow * scale, kRoomHigh * scale, true, cells_per_side);
  if (with_box) add_cuboid(&mesh, kBoxLow * scale, kBoxHigh * scale, false, cells_per_side);
  return mesh;
}

Image TestScene::image(const CameraModel& camera, const Pose<Map, Cam>& map_from_cam) const {
  Image image{camera.width_px, camera.height_px, 3, {}};
  const Vector3d from = map_from_cam.translation() / scale;
  for (int v = 0; v < camera.height_px; ++v) {
    for (int u = 0; u < camera.width_px; ++u) {
      const Vector3d way =
          map_from_cam.rotation() * camera.unproject({double(u), double(v)}).homogeneous();
      const double room = room_distance(from, way);
      const double box = with_box ? box_distance(from, way) : room + 1;
      const Vector3d colour = colour_at(from + std::min(room, box) * way, box < room);
      for (int c = 0; c < 3; ++c) {
        image.bytes.push_back(static_cast<uint8_t>(std::clamp(colour[c] + 0.5, 0.0, 255.0)));
      }
    }
  }
  return image;
}

double TestScene::depth(const CameraModel& camera, const Pose<Map, Cam>& map_from_cam,
                        const Eigen::Vector2d& pixel) const {
  const Vector3d from = map_from_cam.translation() / scale;
  const Vector3d way = map_from_cam.rotation() * camera.unproject(pixel).homogeneous();
  const double room = room_distance(from, way);
  return scale * (with_box ? std::min(room, box_distance(from, way)) : room);
}

Pose<Map, Cam> TestScene::pose(double x, double y, double z, double right_rad) const {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(right_rad, Vector3d::UnitY()));
  return {turn, Vector3d(x, y, z) * scale};
}

TexturingView TestScene::view(int64_t id, const CameraModel& camera,
                              const Pose<Map, Cam>& pose) const {
  return {id, Time{id * 1000}, camera, pose, image(camera, pose)};
}

CameraModel pinhole_camera() {
  CameraModel camera = base_camera();
  camera.prepare();
  return camera;
}

CameraModel radtan_camera() {
  CameraModel camera = base_camera();
  camera.distortion = {-0.25, 0.07, 0.002, -0.001, 0.01};
  camera.prepare();
  return camera;
}

CameraModel fisheye_camera() {
  CameraModel camera = base_camera();
  camera.lens = LensModel::kEquidistant;
  camera.fx_px = camera.fy_px = 150;
  camera.distortion = {0.02, -0.01, 0.003, -0.001, 0};
  camera.prepare();
  return camera;
}

Rgb pixel_at(const Image& image, int u, int v) {
  const uint8_t* p = &image.bytes[3 * (static_cast<size_t>(v) * image.width_px + u)];
  return {p[0], p[1], p[2]};
}

double psnr_db(const Image& a, const Image& b, const std::function<bool(int, int)>& use) {
  EXPECT_EQ(a.bytes.size(), b.bytes.size());
  double sum = 0, count = 0;
  for (int v = 0; v < a.height_px; ++v) {
    for (int u = 0; u < a.width_px; ++u) {
      if (!use(u, v)) continue;
      const Rgb p = pixel_at(a, u, v), q = pixel_at(b, u, v);
      for (int c = 0; c < 3; ++c) sum += (p[c] - q[c]) * (p[c] - q[c]);
      count += 3;
    }
  }
  EXPECT_GT(count, 0);
  return sum == 0 ? 99 : 10 * std::log10(255.0 * 255.0 * count / sum);
}

void save_picture(const Image& image, const std::string& name) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "foresight_renderer";
  std::filesystem::create_directories(folder);
  cv::Mat bgr(image.height_px, image.width_px, CV_8UC3);
  for (size_t i = 0; i < image.bytes.size(); i += 3) {
    std::reverse_copy(&image.bytes[i], &image.bytes[i] + 3, bgr.data + i);
  }
  cv::imwrite((folder / (name + ".png")).string(), bgr);
}

Image colour_sources(const RenderedFrame& frame) {
  Image image{frame.rgb.width_px, frame.rgb.height_px, 3, {}};
  for (const uint8_t code : frame.source) {
    const int rank = source_rank(code);
    Rgb rgb = rank < 0    ? Rgb{40, 40, 50}
              : rank == 0 ? Rgb{60, 180, 80}
                          : Rgb{250, 220 - 30 * rank, 40};
    if (source_is_guess(code)) rgb = {rgb[0] / 2, rgb[1] / 2, 230};
    for (const int value : rgb) image.bytes.push_back(static_cast<uint8_t>(value));
  }
  return image;
}

namespace {
std::unique_ptr<GlContext>& shared_context() {
  static std::unique_ptr<GlContext> context;
  return context;
}
}  // namespace

void RendererTest::SetUpTestSuite() {
  if (!shared_context()) shared_context() = std::make_unique<OffscreenContext>(640, 240);
}

GlContext& RendererTest::context() { return *shared_context(); }

}  // namespace foresight
