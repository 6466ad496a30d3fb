#include "procs/renderer/recorder.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "procs/renderer/picture_fit.h"
#include "tests/common/files.h"

namespace foresight {
namespace {

Image grey(int width_px, int height_px, uint8_t value) {
  return {width_px, height_px, 3,
          std::vector<uint8_t>(static_cast<size_t>(width_px) * height_px * 3, value)};
}

TEST(PictureFit, FillsAsMuchAsTheAspectAllows) {
  EXPECT_EQ(fit_picture(grey(64, 48, 7), 64, 48).bytes, grey(64, 48, 7).bytes);
  for (const auto& [w, h] : {std::pair{128, 48}, {32, 48}, {1, 1}, {640, 480}, {3, 2000}}) {
    const Image fitted = fit_picture(grey(w, h, 200), 64, 48);
    ASSERT_EQ(fitted.width_px, 64);
    ASSERT_EQ(fitted.height_px, 48);
    const auto row = fitted.bytes.begin() + 3 * 24 * 64;
    EXPECT_EQ(*std::max_element(row, row + 3 * 64), 200) << w << " x " << h;
  }
  const Image wide = fit_picture(grey(128, 48, 200), 64, 48);
  EXPECT_EQ(wide.bytes[0], 0) << "black above";
  EXPECT_EQ(wide.bytes[3 * (24 * 64)], 200) << "and as wide as the frame";
}

// Somebody resizes the window while it is recorded.
TEST(Recorder, GoesOnAtTheSizeOfItsBeginning) {
  TemporaryFolder folder;
  {
    Recorder recorder(folder.path() + "/%05d.png", 64, 48, 15);
    EXPECT_TRUE(recorder.write(grey(64, 48, 100)));
    EXPECT_TRUE(recorder.write(grey(200, 90, 100)));
    EXPECT_TRUE(recorder.write(grey(5, 100, 100)));
    EXPECT_TRUE(recorder.write(grey(64, 48, 100)));
    EXPECT_EQ(recorder.frames(), 4);
    EXPECT_EQ(recorder.why_ended(), "");
  }
  int pictures = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder.path())) {
    const cv::Mat picture = cv::imread(file.path().string());
    EXPECT_EQ(picture.size(), cv::Size(64, 48)) << file.path();
    ++pictures;
  }
  EXPECT_EQ(pictures, 4);
}

// A deployed renderer has sockets and graphics open: its files have numbers of two digits.
TEST(Recorder, WorksInAProcessWithManyFilesOpen) {
  std::vector<int> files(20);
  for (int& file : files) file = dup(0);
  TemporaryFolder folder;
  {
    Recorder recorder(folder.path() + "/many.mp4", 64, 48, 15);
    for (int i = 0; i < 20; ++i) EXPECT_TRUE(recorder.write(grey(64, 48, 100)));
    EXPECT_EQ(recorder.why_ended(), "");
  }
  for (const int file : files) close(file);
  EXPECT_GT(std::filesystem::file_size(folder.path() + "/many.mp4"), 500u);
}

std::string why_a_recording_ends(const std::string& path) {
  Recorder recorder(path, 640, 480, 15);
  for (int i = 0; i < 500; ++i) {
    if (!recorder.write(grey(640, 480, static_cast<uint8_t>(i)))) return recorder.why_ended();
  }
  return "never";
}

TEST(Recorder, SaysWhyFfmpegEnded) {
  TemporaryFolder folder;
  const std::string format = why_a_recording_ends(folder.path() + "/film.nosuchformat");
  EXPECT_NE(format.find("ffmpeg ended with exit code"), std::string::npos) << format;
  EXPECT_NE(format.find("nosuchformat"), std::string::npos) << format;
  if (std::filesystem::exists("/dev/full")) {
    std::filesystem::create_symlink("/dev/full", folder.path() + "/film.mp4");
    const std::string full = why_a_recording_ends(folder.path() + "/film.mp4");
    EXPECT_NE(full.find("No space left on device"), std::string::npos) << full;
  }
}

}  // namespace
}  // namespace foresight
