// Videos that ffmpeg writes: turned, of variable rate, cut, damaged.
#include "procs/camera/video_file.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "common/errors.h"
#include "procs/camera/frame_source.h"
#include "procs/camera/recorded_images.h"
#include "tests/common/files.h"

namespace foresight {
namespace {

class Video : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_.path() + "/" + name; }
  std::string ffmpeg(const std::string& arguments, const std::string& name) const {
    const std::string command =
        "ffmpeg -loglevel error -y " + arguments + " " + path(name) + " </dev/null";
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    return path(name);
  }
  // 40 frames of 64 × 48 px at 20 a second, the upper left quarter white, the rest changing.
  std::string plain(const std::string& name = "plain.mp4") const {
    return ffmpeg(
        "-f lavfi -i testsrc2=s=64x48:r=20:d=2 -vf drawbox=w=32:h=24:color=white:t=fill "
        "-pix_fmt yuv420p -g 10",
        name);
  }
  static int red(const Image& image, int x, int y) {
    return image.bytes[static_cast<size_t>(3 * (y * image.width_px + x))];
  }
  TemporaryFolder folder_;
};

TEST_F(Video, IsUprightForEveryAngle) {
  plain();
  for (const int angle : {0, 90, 180, 270}) {
    const std::string turned =
        ffmpeg("-i " + path("plain.mp4") + " -c copy -metadata:s:v rotate=" + std::to_string(angle),
               "r.mp4");
    const auto frame = VideoFile(turned).next();
    ASSERT_TRUE(frame);
    const bool on_its_side = angle % 180 != 0;
    EXPECT_EQ(frame->image.width_px, on_its_side ? 48 : 64);
    EXPECT_EQ(frame->image.height_px, on_its_side ? 64 : 48);
    // ffmpeg itself turns by default: its first picture is what a viewer shows.
    ffmpeg("-i " + turned + " -frames:v 1", "shown.png");
    const Picture shown = read_picture(path("shown.png"), 3);
    ASSERT_EQ(shown.image.width_px, frame->image.width_px);
    double difference = 0;
    for (size_t i = 0; i < shown.image.bytes.size(); ++i) {
      difference += std::abs(shown.image.bytes[i] - frame->image.bytes[i]);
    }
    EXPECT_LT(difference / static_cast<double>(shown.image.bytes.size()), 8) << angle;
  }
}

TEST_F(Video, HasTheContainersStamps) {
  plain();
  // The first second at half the rate: 40 frames in 3 s, B-frames in between.
  for (const char* name : {"vfr.mp4", "vfr.mkv"}) {
    ffmpeg("-i " + path("plain.mp4") +
               " -vf \"setpts='if(lt(N,20),N*0.1,2+(N-20)*0.05)/TB'\" -vsync vfr -bf 2",
           name);
    VideoFile video(path(name));
    int count = 0;
    while (const auto time = video.skip()) {
      const double expected_s = count < 20 ? 0.1 * count : 2 + 0.05 * (count - 20);
      EXPECT_NEAR((*time - Time{}).seconds(), expected_s, 0.002) << name << " " << count;
      ++count;
    }
    EXPECT_EQ(count, 40) << name;
    EXPECT_EQ(video.shortfall(), "") << name;
  }
}

TEST_F(Video, ThatIsDamagedInTheMiddleGoesOn) {
  plain();
  const auto size = std::filesystem::file_size(path("plain.mp4"));
  std::fstream file(path("plain.mp4"), std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(static_cast<std::streamoff>(size / 3));
  file << std::string(size / 8, '\0');
  file.close();
  const auto source = open_frame_source(path("plain.mp4"));
  int count = 0;
  Time last;
  while (const auto frame = source->next()) {
    ++count;
    last = frame->time;
  }
  EXPECT_GT(count, 20);
  EXPECT_LT(count, 40);
  EXPECT_GT((last - Time{}).seconds(), 1.8) << "what is behind the damage is decoded";
  EXPECT_EQ(source->shortfall(), "ended after " + std::to_string(count) + " of 40 frames");
}

TEST_F(Video, ThatIsCutSaysSo) {
  ffmpeg("-i " + plain() + " -c copy -movflags +faststart", "cut.mp4");
  ffmpeg("-i " + path("plain.mp4") + " -c copy", "cut.mkv");
  for (const char* name : {"cut.mp4", "cut.mkv"}) {
    std::filesystem::resize_file(path(name), std::filesystem::file_size(path(name)) * 6 / 10);
    VideoFile video(path(name));
    int count = 0;
    while (video.skip()) ++count;
    EXPECT_GT(count, 5) << name;
    EXPECT_LT(count, 38) << name;
    EXPECT_TRUE(video.shortfall().starts_with("ended after " + std::to_string(count)))
        << name << ": " << video.shortfall();
  }
}

TEST_F(Video, IsTheSameInAnyOrder) {
  plain();
  std::vector<Image> frames;
  const auto source = open_frame_source(path("plain.mp4"));
  while (auto frame = source->next()) frames.push_back(std::move(frame->image));
  ASSERT_EQ(frames.size(), 40u);
  source->rewind();
  EXPECT_EQ(source->next()->image.bytes, frames[0].bytes);
  RecordedImages images(path("plain.mp4"));
  ASSERT_EQ(images.list().size(), 40u);
  EXPECT_NEAR(static_cast<double>(images.list()[39].time.us), 1.95e6, 1);
  for (const size_t i : {0u, 1u, 39u, 38u, 10u, 0u, 35u, 39u}) {
    EXPECT_EQ(images.read(i, 3).image.bytes, frames[i].bytes) << i;
  }
  EXPECT_EQ(images.read(5, 1).image.channels, 1);
}

TEST_F(Video, ThatIsNoneIsRefused) {
  folder_.write("a.mp4", "no video");
  EXPECT_NE(error_of<UnavailableError>([&] { VideoFile video(path("a.mp4")); }).find("a.mp4"),
            std::string::npos);
}

}  // namespace
}  // namespace foresight
