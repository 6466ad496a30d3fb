#include "bench/slam_eval/depth_image.h"

#include <cmath>
#include <opencv2/imgcodecs.hpp>

namespace foresight {
namespace {

struct DepthCam {};

constexpr uint16_t kNothing = 0, kTooFar = 65535;

Pose<Cam, DepthCam> kinect() {
  return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(-0.025, 0, 0)};
}

// Each measured point, put where the colour camera sees it.
cv::Mat registered(const cv::Mat& depth_m, const CameraModel& depth_camera,
                   const CameraModel& camera) {
  const Pose<Cam, DepthCam> cam_from_depth_cam = kinect();
  cv::Mat carried = cv::Mat::zeros(depth_m.size(), CV_32F);
  for (int y = 0; y < depth_m.rows; ++y) {
    for (int x = 0; x < depth_m.cols; ++x) {
      const auto z = static_cast<double>(depth_m.at<float>(y, x));
      if (z <= 0) continue;
      const Eigen::Vector2d ray = depth_camera.unproject({x, y});
      const Eigen::Vector3d p = cam_from_depth_cam * Eigen::Vector3d(z * ray.homogeneous());
      if (p.z() <= 0 || !camera.in_image(camera.project(p))) continue;
      const Eigen::Vector2d pixel = camera.project(p);
      float& there = carried.at<float>(static_cast<int>(std::lround(pixel.y())),
                                       static_cast<int>(std::lround(pixel.x())));
      if (there == 0 || p.z() < static_cast<double>(there)) there = static_cast<float>(p.z());
    }
  }
  return carried;
}

std::string depth_fault(const cv::Mat& raw, const CameraModel& camera) {
  if (raw.empty()) return "cannot be read as an image";
  if (raw.type() != CV_16UC1) return "is no 16-bit gray image";
  if (raw.cols == camera.width_px && raw.rows == camera.height_px) return "";
  return "has another size than the images: " + std::to_string(raw.cols) + "x" +
         std::to_string(raw.rows) + " px";
}

}  // namespace

cv::Mat load_depth(const Sequence& sequence, const SequenceImage& entry, InputReport* report) {
  const CameraModel& camera = sequence.camera;
  const cv::Mat raw = cv::imread(entry.path, cv::IMREAD_UNCHANGED);
  const std::string fault = depth_fault(raw, camera);
  if (report != nullptr && fault.empty()) report->use();
  if (report != nullptr && !fault.empty()) report->refuse(entry.path, fault);
  if (!fault.empty()) return {};
  cv::Mat depth_m;
  raw.convertTo(depth_m, CV_32F, sequence.depth_scale);
  depth_m.setTo(0, (raw == kNothing) | (raw == kTooFar));
  if (!sequence.depth_camera) return depth_m;
  return registered(depth_m, *sequence.depth_camera, camera);
}

}  // namespace foresight
