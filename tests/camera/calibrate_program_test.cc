// calibrate-camera from a folder of pictures to a camera file.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "common/camera_model.h"
#include "tests/camera/drawn_boards.h"
#include "tests/common/files.h"

namespace foresight {
namespace {

struct Outcome {
  int code = -1;
  std::string text;
};

Outcome calibrate(const std::string& arguments) {
  FILE* pipe = popen((CALIBRATE_CAMERA " " + arguments + " 2>&1").c_str(), "r");
  Outcome outcome;
  std::array<char, 256> piece;
  while (std::fgets(piece.data(), piece.size(), pipe) != nullptr) outcome.text += piece.data();
  outcome.code = WEXITSTATUS(pclose(pipe));
  return outcome;
}

class CalibrateProgramTest : public testing::Test {
 protected:
  void write_pictures(const std::vector<cv::Mat>& pictures) const {
    std::string list;
    std::filesystem::create_directory(temp_.path() + "/rgb");
    for (size_t i = 0; i < pictures.size(); ++i) {
      const std::string name = "rgb/" + std::to_string(i) + ".png";
      cv::imwrite(temp_.path() + "/" + name, pictures[i]);
      list += std::to_string(100 + 0.1 * static_cast<double>(i)) + " " + name + "\n";
    }
    temp_.write("rgb.txt", list);
  }
  std::string output() const { return temp_.path() + "/camera.yaml"; }
  Outcome calibrate_pictures(const std::string& options) const {
    return calibrate(temp_.path() + " --size 0.03 --every 1 --output " + output() + " " + options);
  }

  TemporaryFolder temp_;
};

TEST_F(CalibrateProgramTest, WritesTheLensThatTookThePictures) {
  const CalibrationBoard board{CalibrationBoard::Kind::kChessboard, 9, 6, 0.03, 0};
  const CameraModel truth = camera_with(LensModel::kRadtan);
  std::vector<cv::Mat> pictures;
  for (const Eigen::Isometry3d& pose : poses(truth.fx_px, 0.24, 0.15)) {
    pictures.push_back(render(truth, chessboard(board), pose));
  }
  write_pictures(pictures);
  const Outcome outcome = calibrate_pictures("--columns 9 --rows 6");
  ASSERT_EQ(outcome.code, 0) << outcome.text;
  EXPECT_NE(outcome.text.find("wrote " + output()), std::string::npos) << outcome.text;
  const CameraModel found = load_camera_file(output());
  EXPECT_EQ(found.width_px, 640);
  EXPECT_EQ(found.height_px, 480);
  EXPECT_EQ(found.lens, LensModel::kRadtan);
  EXPECT_NEAR(found.fx_px, truth.fx_px, 0.01 * truth.fx_px);
  EXPECT_NEAR(found.fy_px, truth.fy_px, 0.01 * truth.fy_px);
  // What is there is not replaced unless asked to.
  const Outcome again = calibrate_pictures("");
  EXPECT_EQ(again.code, 64);
  EXPECT_NE(again.text.find("--overwrite"), std::string::npos) << again.text;
}

TEST_F(CalibrateProgramTest, SaysThatThereIsNoBoard) {
  write_pictures(std::vector<cv::Mat>(5, cv::Mat(480, 640, CV_8UC1, cv::Scalar::all(90))));
  const Outcome outcome = calibrate_pictures("");
  EXPECT_EQ(outcome.code, 69);
  EXPECT_NE(outcome.text.find("no board in 5 frames"), std::string::npos) << outcome.text;
  EXPECT_FALSE(std::filesystem::exists(output()));
}

TEST_F(CalibrateProgramTest, SaysThatThereAreNoPictures) {
  const Outcome outcome = calibrate_pictures("");
  EXPECT_NE(outcome.code, 0);
  EXPECT_NE(outcome.text.find(temp_.path()), std::string::npos) << outcome.text;
}

}  // namespace
}  // namespace foresight
