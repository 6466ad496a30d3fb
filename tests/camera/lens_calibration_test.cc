// Boards drawn through known lenses, ray by ray.
#include "procs/camera/lens_calibration.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <opencv2/aruco.hpp>
#include <opencv2/imgproc.hpp>

#include "common/errors.h"
#include "tests/common/files.h"

namespace foresight {
namespace {

constexpr int kTexel = 24;  // per square

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

// A texture of `square_m`/kTexel metres a texel whose origin is at (left, top) on the board.
struct Print {
  cv::Mat texture;
  double left_m, top_m, texel_m;
};

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

// The board in the middle, in the corners, tilted, near and far.
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

ViewCollector collect(const CameraModel& camera, const CalibrationBoard& board, const Print& print,
                      double width_m, double height_m) {
  ViewCollector collector(640, 480);
  for (const Eigen::Isometry3d& pose : poses(camera.fx_px, width_m, height_m)) {
    if (auto view = find_board(render(camera, print, pose), board)) collector.add(*view);
  }
  return collector;
}

void expect_same(const CameraModel& found, const CameraModel& truth) {
  EXPECT_NEAR(found.fx_px, truth.fx_px, 0.01 * truth.fx_px);
  EXPECT_NEAR(found.fy_px, truth.fy_px, 0.01 * truth.fy_px);
  EXPECT_NEAR(found.cx_px, truth.cx_px, 2);
  EXPECT_NEAR(found.cy_px, truth.cy_px, 2);
  for (const double x : {-0.5, 0.0, 0.5}) {  // rays to pixels, which is what counts
    for (const double y : {-0.35, 0.0, 0.35}) {
      const Eigen::Vector2d a = found.project_normalized({x, y}),
                            b = truth.project_normalized({x, y});
      EXPECT_LT((a - b).norm(), 2) << x << " " << y;
    }
  }
}

TEST(LensCalibration, FindsTheLensFromAChessboard) {
  const CalibrationBoard board{CalibrationBoard::Kind::kChessboard, 9, 6, 0.03, 0};
  for (const LensModel lens : {LensModel::kRadtan, LensModel::kEquidistant}) {
    const CameraModel truth = camera_with(lens);
    const ViewCollector collector = collect(truth, board, chessboard(board), 0.24, 0.15);
    ASSERT_GE(collector.views().size(), 12u);
    EXPECT_GT(collector.coverage(), 0.5);
    const Calibration c = calibrate_lens(collector.views(), 640, 480, lens);
    EXPECT_LT(c.held_out_rms_px, 0.3);
    EXPECT_GE(c.held_out_views, 3);
    expect_same(c.camera, truth);
  }
}

TEST(LensCalibration, FindsTheLensFromAprilTags) {
  const CalibrationBoard board{CalibrationBoard::Kind::kAprilTags, 4, 3, 0.06, 0.018};
  const CameraModel truth = camera_with(LensModel::kRadtan);
  const ViewCollector collector = collect(truth, board, tags(board), 0.29, 0.21);
  ASSERT_GE(collector.views().size(), 12u);
  const Calibration c = calibrate_lens(collector.views(), 640, 480, LensModel::kRadtan);
  EXPECT_LT(c.held_out_rms_px, 0.5);
  expect_same(c.camera, truth);
}

TEST(LensCalibration, DropsAViewThatIsWrong) {
  const CalibrationBoard board{CalibrationBoard::Kind::kChessboard, 9, 6, 0.03, 0};
  const CameraModel truth = camera_with(LensModel::kRadtan);
  std::vector<BoardView> views = collect(truth, board, chessboard(board), 0.24, 0.15).views();
  ASSERT_GE(views.size(), 12u);
  for (size_t i = 0; i < views[0].pixels.size(); ++i) {  // a bent board
    views[0].pixels[i].x += 6 * std::sin(0.7f * static_cast<float>(i));
  }
  const Calibration c = calibrate_lens(views, 640, 480, LensModel::kRadtan);
  EXPECT_EQ(c.dropped_views, 1);
  expect_same(c.camera, truth);
}

TEST(LensCalibration, WritesAFileThatLoads) {
  Calibration c;
  c.camera = camera_with(LensModel::kEquidistant);
  const TemporaryFolder folder;
  EXPECT_EQ(load_camera_file(folder.write("a.yaml", camera_file_text(c))), c.camera);
  c.camera = camera_with(LensModel::kRadtan);
  EXPECT_EQ(load_camera_file(folder.write("b.yaml", camera_file_text(c))), c.camera);
}

TEST(LensCalibration, SaysWhatIsMissing) {
  EXPECT_FALSE(find_board(cv::Mat(480, 640, CV_8UC1, cv::Scalar::all(90)), {}));
  EXPECT_THROW((void)calibrate_lens({}, 640, 480, LensModel::kRadtan), UnavailableError);
  ViewCollector collector(640, 480);
  EXPECT_EQ(collector.coverage(), 0);
  BoardView view;
  for (int i = 0; i < 12; ++i) {
    view.points_m.emplace_back(0.01f * static_cast<float>(i), 0.f, 0.f);
    view.pixels.emplace_back(330.f + 25 * static_cast<float>(i), 20.f + 20 * static_cast<float>(i));
  }
  EXPECT_TRUE(collector.add(view));
  EXPECT_FALSE(collector.add(view));  // nothing new
  EXPECT_FALSE(collector.emptiest_part().empty());
  // The same view again and again, a little moved: it determines no lens.
  std::vector<BoardView> same(10, view);
  EXPECT_THROW((void)calibrate_lens(same, 640, 480, LensModel::kRadtan), UnavailableError);
}

}  // namespace
}  // namespace foresight
