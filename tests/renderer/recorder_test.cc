#include "procs/renderer/recorder.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <thread>

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
    EXPECT_EQ(Recorder::Written::kYes, recorder.write(grey(64, 48, 100)));
    EXPECT_EQ(Recorder::Written::kYes, recorder.write(grey(200, 90, 100)));
    EXPECT_EQ(Recorder::Written::kYes, recorder.write(grey(5, 100, 100)));
    EXPECT_EQ(Recorder::Written::kYes, recorder.write(grey(64, 48, 100)));
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
    for (int i = 0; i < 20; ++i)
      EXPECT_EQ(Recorder::Written::kYes, recorder.write(grey(64, 48, 100)));
    EXPECT_EQ(recorder.why_ended(), "");
  }
  for (const int file : files) close(file);
  EXPECT_GT(std::filesystem::file_size(folder.path() + "/many.mp4"), 500u);
}

std::string why_a_recording_ends(const std::string& path) {
  Recorder recorder(path, 640, 480, 15);
  for (int i = 0; i < 2000; ++i) {
    const auto written = recorder.write(grey(640, 480, static_cast<uint8_t>(i)));
    if (written == Recorder::Written::kEnded) return recorder.why_ended();
    if (written == Recorder::Written::kDropped) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
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

// An ffmpeg that stops reading, by a script of that name in front of the real one.
class HangingFfmpeg : public testing::Test {
 protected:
  void begin(const std::string& script) {
    folder_.write("ffmpeg", "#!/bin/sh\n" + script + "\n");
    std::filesystem::permissions(folder_.path() + "/ffmpeg", std::filesystem::perms::owner_all);
    path_ = std::getenv("PATH");
    setenv("PATH", (folder_.path() + ":" + path_).c_str(), 1);
  }
  void TearDown() override { setenv("PATH", path_.c_str(), 1); }
  static double seconds_since(std::chrono::steady_clock::time_point begin) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }
  TemporaryFolder folder_;
  std::string path_;
};

TEST_F(HangingFfmpeg, HoldsNobodyUp) {
  begin("exec sleep 1000");
  const auto began = std::chrono::steady_clock::now();
  {
    Recorder recorder(folder_.path() + "/film.mp4", 640, 480, 15);
    int dropped = 0;
    for (int i = 0; i < 100; ++i) {
      const auto written = recorder.write(grey(640, 480, 1));
      ASSERT_NE(written, Recorder::Written::kEnded);
      dropped += written == Recorder::Written::kDropped ? 1 : 0;
    }
    EXPECT_LT(seconds_since(began), 3) << "of 100 pictures, the time to start included";
    EXPECT_GT(dropped, 90);
    EXPECT_EQ(recorder.dropped(), dropped);
    EXPECT_EQ(recorder.frames(), 100 - dropped);
  }
  EXPECT_LT(seconds_since(began), 6.5) << "to its end: supervisord's patience is 7 s";
}

TEST_F(HangingFfmpeg, GoesOnWithWholePicturesWhenItReadsAgain) {
  begin("cd " + folder_.path() + "; head -c 4000000 > raw; sleep 0.7; exec cat >> raw");
  constexpr size_t kPicture_bytes = 640 * 480 * 3;
  int64_t frames = 0;
  {
    Recorder recorder(folder_.path() + "/film.mp4", 640, 480, 15);
    for (int i = 1; i <= 100; ++i) {
      static_cast<void>(recorder.write(grey(640, 480, static_cast<uint8_t>(i))));
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    EXPECT_GT(recorder.dropped(), 5);
    EXPECT_GT(recorder.frames(), 30);
    frames = recorder.frames();
  }
  std::ifstream file(folder_.path() + "/raw", std::ios::binary);
  const std::string raw{std::istreambuf_iterator<char>(file), {}};
  ASSERT_EQ(raw.size(), static_cast<size_t>(frames) * kPicture_bytes);
  for (size_t at = 0; at < raw.size(); at += kPicture_bytes) {
    EXPECT_EQ(raw.find_first_not_of(raw[at], at),
              at + kPicture_bytes < raw.size() ? at + kPicture_bytes : std::string::npos)
        << "a picture is torn at " << at;
  }
}

}  // namespace
}  // namespace foresight
