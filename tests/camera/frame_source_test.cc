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

TEST(FolderSource, SaysWhichFileIsDamagedOrMissing) {
  const TemporaryFolder folder;
  write_sequence(folder, 3);
  folder.write("rgb/1.png", "no picture");
  std::filesystem::remove(folder.path() + "/rgb/2.png");
  const auto source = open_frame_source(folder.path());
  EXPECT_TRUE(source->next());
  EXPECT_FALSE(source->next());
  EXPECT_NE(source->error().find("rgb/1.png"), std::string::npos);
  EXPECT_FALSE(source->next());
  EXPECT_NE(source->error().find("rgb/2.png"), std::string::npos);
}

TEST(FolderSource, RefusesAListThatMakesNoSense) {
  const TemporaryFolder folder;
  const auto refusal = [&] {
    return error_of<ConfigError>([&] { open_frame_source(folder.path()); });
  };
  EXPECT_NE(refusal().find("TUM layout"), std::string::npos);
  folder.write("rgb.txt", "# nothing\n\n");
  EXPECT_NE(refusal().find("lists no frames"), std::string::npos);
  folder.write("rgb.txt", "1.0 a.png\nb.png 2.0\n");
  EXPECT_NE(refusal().find("rgb.txt:2"), std::string::npos);
  for (const std::string stamp : {"nan", "inf", "-5", "1e300"}) {
    folder.write("rgb.txt", stamp + " a.png\n");
    refusal();
  }
  folder.write("rgb.txt", "2.0 a.png\n1.0 b.png\n");
  EXPECT_NE(refusal().find("rgb.txt:2"), std::string::npos) << "time must not go back";
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
