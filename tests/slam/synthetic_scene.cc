#include "tests/slam/synthetic_scene.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace foresight {
cv::Mat random_texture(cv::RNG* rng, int size_px) {
  cv::Mat sum(size_px, size_px, CV_32F, cv::Scalar::all(128));
  for (const int cell : {4, 8, 16, 40}) {
    cv::Mat noise(size_px / cell, size_px / cell, CV_32F), large;
    rng->fill(noise, cv::RNG::UNIFORM, -45, 45);
    cv::resize(noise, large, sum.size(), 0, 0, cv::INTER_LINEAR);
    sum += large;
  }
  cv::Mat texture;
  sum.convertTo(texture, CV_8U);
  return texture;
}

CameraModel test_camera() {
  CameraModel camera;
  camera.width_px = 640;
  camera.height_px = 480;
  camera.fx_px = camera.fy_px = 500;
  camera.cx_px = 319.5;
  camera.cy_px = 239.5;
  camera.prepare();
  return camera;
}

SyntheticScene::SyntheticScene(uint64_t seed) {
  cv::RNG rng(seed);
  const auto add = [&](double depth, double left, double top, double width, double height,
                       int size_px) {
    planes_.push_back(
        {{left, top, depth}, {width, 0, 0}, {0, height, 0}, random_texture(&rng, size_px)});
  };
  add(4.0, -5, -4, 10, 8, 1600);
  add(3.0, -1.6, -0.2, 1.4, 1.4, 480);
  add(2.2, 0.2, -0.9, 0.9, 0.9, 480);
}

SyntheticScene SyntheticScene::wall(uint64_t seed) {
  SyntheticScene scene(seed);
  scene.planes_.resize(1);
  return scene;
}

namespace {

// The wall that is `quarters` turns to the right, with panels in front of it.
void add_room_wall(int quarters, cv::RNG* rng, std::vector<TexturedPlane>* planes) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(quarters * M_PI / 2, Eigen::Vector3d::UnitY()));
  const auto add = [&](double depth, double left, double top, double width, double height,
                       int size_px) {
    planes->push_back({turn * Eigen::Vector3d(left, top, depth),
                       turn * Eigen::Vector3d(width, 0, 0),
                       {0, height, 0},
                       random_texture(rng, size_px)});
  };
  const double far = rng->uniform(2.5, 3.2);
  add(far, -3.3, -2, 6.6, 4, 1200);
  for (const double left : {-1.8, -0.4, 0.9}) {
    const double size = rng->uniform(0.5, 0.9);
    add(far - rng->uniform(0.3, 0.9), left, rng->uniform(-0.8, 0.2), size, size, 240);
  }
}

}  // namespace

SyntheticScene SyntheticScene::room(uint64_t seed) {
  SyntheticScene scene;
  cv::RNG rng(seed);
  for (int wall = 0; wall < 4; ++wall) add_room_wall(wall, &rng, &scene.planes_);
  return scene;
}

SyntheticScene SyntheticScene::room_of_equal_walls(uint64_t seed) {
  SyntheticScene scene;
  for (int wall = 0; wall < 4; ++wall) {
    cv::RNG rng(seed);
    add_room_wall(wall, &rng, &scene.planes_);
  }
  return scene;
}

namespace {

// Where a ray meets a rectangle.
struct Hit {
  double distance = 0;         // in lengths of the ray
  double right = 0, down = 0;  // 0…1
};

// Of rays from one place: everything that does not depend on the pixel.
class PlaneCaster {
 public:
  PlaneCaster(const TexturedPlane& plane, const Eigen::Vector3d& from)
      : texture_(plane.texture),
        normal_(plane.right.cross(plane.down)),
        offset_(normal_.dot(plane.corner - from)),
        right_(plane.right / plane.right.squaredNorm()),
        down_(plane.down / plane.down.squaredNorm()),
        from_corner_(from - plane.corner) {}

  bool meet(const Eigen::Vector3d& ray, Hit* hit) const {
    hit->distance = offset_ / normal_.dot(ray);
    if (!(hit->distance > 0)) return false;
    const Eigen::Vector3d at = from_corner_ + hit->distance * ray;
    hit->right = right_.dot(at);
    hit->down = down_.dot(at);
    return hit->right >= 0 && hit->right < 1 && hit->down >= 0 && hit->down < 1;
  }

  // Bilinear.
  uint8_t level(const Hit& hit) const {
    const double x = std::clamp(hit.right * texture_.cols - 0.5, 0.0, texture_.cols - 1.001);
    const double y = std::clamp(hit.down * texture_.rows - 0.5, 0.0, texture_.rows - 1.001);
    const int column = static_cast<int>(x), row = static_cast<int>(y);
    const double u = x - column, v = y - row;
    const uint8_t *upper = texture_.ptr(row) + column, *lower = texture_.ptr(row + 1) + column;
    return static_cast<uint8_t>((1 - v) * ((1 - u) * upper[0] + u * upper[1]) +
                                v * ((1 - u) * lower[0] + u * lower[1]) + 0.5);
  }

 private:
  const cv::Mat& texture_;
  Eigen::Vector3d normal_;
  double offset_;
  Eigen::Vector3d right_, down_, from_corner_;
};

class RayCaster {
 public:
  RayCaster(const std::vector<TexturedPlane>& planes, const CameraModel& camera,
            const Pose<World, Cam>& world_from_cam)
      : camera_(camera), rotation_(world_from_cam.rotation().toRotationMatrix()) {
    for (const TexturedPlane& p : planes) casters_.emplace_back(p, world_from_cam.translation());
  }

  Eigen::Vector3d ray_of(const Eigen::Vector2d& pixel) const {
    const Eigen::Vector2d xy = camera_.unproject(pixel);
    return rotation_ * Eigen::Vector3d(xy.x(), xy.y(), 1);
  }

  // The plane that a ray meets first; null if there is none.
  const PlaneCaster* meet(const Eigen::Vector3d& ray, Hit* nearest) const {
    const PlaneCaster* met = nullptr;
    Hit hit;
    for (const PlaneCaster& caster : casters_) {
      if (!caster.meet(ray, &hit) || (met != nullptr && hit.distance > nearest->distance)) continue;
      *nearest = hit;
      met = &caster;
    }
    return met;
  }

 private:
  const CameraModel& camera_;
  Eigen::Matrix3d rotation_;
  std::vector<PlaneCaster> casters_;
};

}  // namespace

std::optional<Eigen::Vector3d> SyntheticScene::point_at(const CameraModel& camera,
                                                        const Pose<World, Cam>& world_from_cam,
                                                        const Eigen::Vector2d& pixel) const {
  const RayCaster caster(planes_, camera, world_from_cam);
  const Eigen::Vector3d ray = caster.ray_of(pixel);
  Hit hit;
  if (caster.meet(ray, &hit) == nullptr) return std::nullopt;
  return world_from_cam.translation() + hit.distance * ray;
}

cv::Mat SyntheticScene::render(const CameraModel& camera,
                               const Pose<World, Cam>& world_from_cam) const {
  cv::Mat image(camera.height_px, camera.width_px, CV_8UC1, cv::Scalar::all(0));
  const RayCaster caster(planes_, camera, world_from_cam);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      Hit hit;
      const PlaneCaster* met = caster.meet(caster.ray_of({x, y}), &hit);
      if (met != nullptr) image.at<uint8_t>(y, x) = met->level(hit);
    }
  }
  return image;
}

GrayImageView view_of(const cv::Mat& image) {
  return {image.data, image.cols, image.rows, static_cast<int>(image.step[0])};
}

Pose<World, Cam> sideways_pose(double t) {
  const Eigen::AngleAxisd turn(-0.08 * t, Eigen::Vector3d(0.2, 1, 0.1).normalized());
  return {Eigen::Quaterniond(turn), {0.8 * t, 0.06 * std::sin(6 * t), 0.1 * t}};
}

Pose<Cam, Cam> bent_over() {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ())), {0, 0, 0.8}};
}

cv::Mat out_of_focus(const cv::Mat& sharp) {
  cv::Mat blurred;
  cv::GaussianBlur(sharp, blurred, {}, 4);
  return blurred;
}

Pose<World, Cam> winding_pose(double t) {
  const Eigen::Vector3d turn(0.15 * std::sin(5 * t), 0.3 * std::sin(8 * t), 0.2 * std::sin(3 * t));
  return {Eigen::Quaterniond(Eigen::AngleAxisd(turn.norm() + 1e-12,
                                               (turn + Eigen::Vector3d(0, 0, 1e-12)).normalized())),
          {0.8 * t, 0.15 * std::sin(6 * t), 0.5 * std::sin(2 * t)}};
}

Pose<World, Cam> ring_pose(double t) {
  const double angle = 2 * M_PI * t;
  const Eigen::Quaterniond yaw(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY()));
  const Eigen::Quaterniond pitch(
      Eigen::AngleAxisd(0.05 * std::sin(3 * angle), Eigen::Vector3d::UnitX()));
  const Eigen::Vector3d from(0, 0.06 * std::sin(2 * angle), 0.8 + 0.05 * std::sin(5 * angle));
  return {yaw * pitch, yaw * from};
}

}  // namespace foresight
