#include "tests/slam/synthetic_scene.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace foresight {
namespace {

// Blobs of several sizes: corners on every pyramid level.
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

}  // namespace

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
  planes_.push_back({4.0, -5, -4, 10, 8, random_texture(&rng, 1600)});
  planes_.push_back({3.0, -1.6, -0.2, 1.4, 1.4, random_texture(&rng, 480)});
  planes_.push_back({2.2, 0.2, -0.9, 0.9, 0.9, random_texture(&rng, 480)});
}

SyntheticScene SyntheticScene::wall(uint64_t seed) {
  SyntheticScene scene(seed);
  scene.planes_.resize(1);
  return scene;
}

cv::Mat SyntheticScene::render(const CameraModel& camera,
                               const Pose<World, Cam>& world_from_cam) const {
  cv::Mat image(camera.height_px, camera.width_px, CV_8UC1, cv::Scalar::all(0));
  const Pose<Cam, World> cam_from_world = world_from_cam.inverse();
  const Eigen::Matrix3d rotation = cam_from_world.rotation().toRotationMatrix();
  for (const TexturedPlane& plane : planes_) {
    const double step_x = plane.width_m / plane.texture.cols;
    const double step_y = plane.height_m / plane.texture.rows;
    const Eigen::Vector3d corner(plane.left_m, plane.top_m, plane.depth_m);
    Eigen::Matrix3d intrinsics, cam_from_texel;
    intrinsics << camera.fx_px, 0, camera.cx_px, 0, camera.fy_px, camera.cy_px, 0, 0, 1;
    cam_from_texel << step_x * rotation.col(0), step_y * rotation.col(1), cam_from_world * corner;
    const Eigen::Matrix3d h = intrinsics * cam_from_texel;
    cv::Mat homography(3, 3, CV_64F);
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) homography.at<double>(r, c) = h(r, c);
    }
    cv::warpPerspective(plane.texture, image, homography, image.size(), cv::INTER_LINEAR,
                        cv::BORDER_TRANSPARENT);
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

}  // namespace foresight
