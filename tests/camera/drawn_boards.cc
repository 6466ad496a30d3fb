#include "tests/camera/drawn_boards.h"

#include <opencv2/aruco.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace foresight {

namespace {
constexpr int kTexel = 24;  // per square
}

CameraModel camera_with(LensModel lens) {
  CameraModel c;
  c.lens = lens;
  c.width_px = 640;
  c.height_px = 480;
  c.fx_px = 430;
  c.fy_px = 434;
  c.cx_px = 326;
  c.cy_px = 233;
  if (lens == LensModel::kEquidistant) {
    c.fx_px = c.fy_px = 300;
    c.distortion = {-0.02, 0.005, -0.002, 0.0005, 0};
  } else {
    c.distortion = {-0.22, 0.06, 0.001, -0.0008, 0};
  }
  c.prepare();
  return c;
}

Print chessboard(const CalibrationBoard& board) {
  const int columns = board.columns + 1, rows = board.rows + 1;
  cv::Mat texture((rows + 2) * kTexel, (columns + 2) * kTexel, CV_8UC1, cv::Scalar::all(235));
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      if ((r + c) % 2 == 0) {
        texture(cv::Rect((c + 1) * kTexel, (r + 1) * kTexel, kTexel, kTexel)) = 25;
      }
    }
  }
  return {texture, -2 * board.spacing_m, -2 * board.spacing_m, board.spacing_m / kTexel};
}

Print tags(const CalibrationBoard& board) {
  const int side = 10 * kTexel, pitch = 13 * kTexel;  // gap: 0.3 of the side
  cv::Mat texture(board.rows * pitch + kTexel * 3, board.columns * pitch + kTexel * 3, CV_8UC1,
                  cv::Scalar::all(235));
  const auto family = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11);
  for (int i = 0; i < board.columns * board.rows; ++i) {
    cv::Mat marker;
    cv::aruco::drawMarker(family, i, side, marker);
    marker.copyTo(texture(cv::Rect(3 * kTexel + pitch * (i % board.columns),
                                   3 * kTexel + pitch * (i / board.columns), side, side)));
  }
  const double texel_m = board.spacing_m / side;
  return {texture, -3 * kTexel * texel_m, -3 * kTexel * texel_m, texel_m};
}

cv::Mat render(const CameraModel& camera, const Print& print,
               const Eigen::Isometry3d& cam_from_board) {
  cv::Mat map_x(480, 640, CV_32F), map_y(480, 640, CV_32F), image;
  const Eigen::Isometry3d board_from_cam = cam_from_board.inverse();
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      const Eigen::Vector2d xy = camera.unproject({u, v});
      const Eigen::Vector3d way = board_from_cam.linear() * Eigen::Vector3d(xy.x(), xy.y(), 1);
      const Eigen::Vector3d from = board_from_cam.translation();
      const Eigen::Vector3d hit = from - from.z() / way.z() * way;
      // Texel centres are at half texels.
      map_x.at<float>(v, u) = static_cast<float>((hit.x() - print.left_m) / print.texel_m - 0.5);
      map_y.at<float>(v, u) = static_cast<float>((hit.y() - print.top_m) / print.texel_m - 0.5);
    }
  }
  cv::Mat smooth;
  cv::GaussianBlur(print.texture, smooth, {0, 0}, 2);
  cv::remap(smooth, image, map_x, map_y, cv::INTER_LINEAR, cv::BORDER_CONSTANT,
            cv::Scalar::all(120));
  return image;
}

std::vector<Eigen::Isometry3d> poses(double focal_px, double width_m, double height_m) {
  std::vector<Eigen::Isometry3d> all;
  for (const double at_430_px : {1.5, 2.1}) {
    const double distance = at_430_px * focal_px / 430;
    for (const auto& [x, y] : {std::pair(0., 0.),
                               {-0.35, -0.25},
                               {0.35, -0.25},
                               {0.35, 0.25},
                               {-0.35, 0.25},
                               {0.1, 0.3}}) {
      for (const double tilt : {-0.5, 0.5}) {
        Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
        pose.linear() = Eigen::AngleAxisd(tilt, Eigen::Vector3d(0.6 + x, 1 - y, 0.1).normalized())
                            .toRotationMatrix();
        pose.translation() = width_m * Eigen::Vector3d(x * at_430_px, y * at_430_px, distance) -
                             pose.linear() * Eigen::Vector3d(width_m / 2, height_m / 2, 0);
        all.push_back(pose);
      }
    }
  }
  return all;
}

}  // namespace foresight
