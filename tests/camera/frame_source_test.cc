#include "procs/camera/frame_source.h"

#include <gtest/gtest.h>

#include "common/errors.h"
#include "tests/camera/sequences.h"

namespace foresight {
namespace {

TEST(FolderSource, GivesFramesWithTheirTimesInOrderAndAgain) {
  const TemporaryFolder folder;
  const auto source = open_frame_source(write_sequence(folder, 3));
  for (int pass = 0; pass < 2; ++pass) {
    for (int i = 0; i < 3; ++i) {
      const auto frame = source->next();
      ASSERT_TRUE(frame);
      EXPECT_EQ(frame->time.us, 100'000'000 + 100'000 * i);
      EXPECT_EQ(frame->image.width_px, kWidth_px);
      EXPECT_EQ(frame->image.channels, 3);
      EXPECT_EQ(frame->image.bytes[0], 10 * i) << "RGB, not OpenCV's BGR";
    }
    EXPECT_FALSE(source->next());
    EXPECT_EQ(source->error(), "");
    source->rewind();
  }
}

TEST(FolderSource, HandsOnAJpegAsItIs) {
  const TemporaryFolder folder;
  const auto source = open_frame_source(write_sequence(folder, 1, "jpg"));
  const auto frame = source->next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->jpeg.size(), std::filesystem::file_size(folder.path() + "/rgb/0.jpg"));
}

TEST(FolderSource, SaysWhichFileIsDamagedOrMissingAndGoesOn) {
  const TemporaryFolder folder;
  write_sequence(folder, 5);
  folder.write("rgb/1.png", "no picture");
  std::filesystem::remove(folder.path() + "/rgb/2.png");
  folder.write("rgb/3.png", "");
  const auto source = open_frame_source(folder.path());
  for (const char* error : {"", "cannot be read as an image", "does not exist", "is empty", ""}) {
    const auto frame = source->next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->error, error);
    EXPECT_EQ(frame->image.is_valid(), frame->error.empty());
    EXPECT_NE(frame->name.find("/rgb/"), std::string::npos);
  }
  EXPECT_FALSE(source->next());
}

TEST(FolderSource, SixteenBitImagesAreScaledAlike) {
  const TemporaryFolder folder;
  std::string list;
  for (int i = 0; i < 3; ++i) {
    const std::string name = std::to_string(i) + ".png";
    cv::imwrite(folder.path() + "/" + name, cv::Mat(48, 64, CV_16UC1, cv::Scalar(1000 * (i + 1))));
    list += std::to_string(i) + " " + name + "\n";
  }
  folder.write("rgb.txt", list);
  const auto source = open_frame_source(folder.path());
  EXPECT_NE(source->note().find("12 of 16 bits"), std::string::npos);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(source->next()->image.bytes[0], 1000 * (i + 1) / 16);
}

TEST(FolderSource, RefusesAListThatMakesNoSense) {
  const TemporaryFolder folder;
  EXPECT_NE(error_of<ConfigError>([&] { open_frame_source(folder.path()); }).find("TUM layout"),
            std::string::npos);
}

TEST(FrameSource, SaysWhatItNeedsWhenItIsGivenNothing) {
  const auto refusal = [](const std::string& source) {
    return error_of<StartupError>([&] { open_frame_source(source); });
  };
  EXPECT_NE(refusal("").find("source"), std::string::npos);
  EXPECT_NE(refusal("/no/such/thing").find("/no/such/thing"), std::string::npos);
  EXPECT_NE(refusal("/dev/video77").find("/dev/video77"), std::string::npos);
  const TemporaryFolder folder;
  EXPECT_NE(refusal(folder.write("a.mp4", "no video")).find("video"), std::string::npos);
}

}  // namespace
}  // namespace foresight
