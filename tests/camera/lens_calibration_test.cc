#include "procs/camera/lens_calibration.h"

#include <gtest/gtest.h>

#include "common/errors.h"
#include "tests/camera/drawn_boards.h"
#include "tests/common/files.h"

namespace foresight {
namespace {

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
