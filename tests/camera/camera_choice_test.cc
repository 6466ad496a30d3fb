// One rule for which intrinsics go with which images.
#include "procs/camera/camera_choice.h"

#include <gtest/gtest.h>

#include "common/errors.h"
#include "tests/common/files.h"

namespace foresight {
namespace {

constexpr const char* kCamera =
    "model: pinhole_radtan\nwidth: 640\nheight: 480\nfx: 525\nfy: 524\ncx: 308\ncy: 236\n"
    "k1: 0.1\nk2: 0\np1: 0\np2: 0\n";

TEST(CameraChoice, ScalesAnotherResolutionOfTheSameAspect) {
  const TemporaryFolder folder;
  folder.write("camera.yaml", kCamera);
  const ChosenCamera same = choose_camera(folder.path(), "", 640, 480);
  EXPECT_EQ(same.note, "");
  const ChosenCamera half = choose_camera(folder.path(), "", 320, 240);
  EXPECT_FALSE(half.is_guessed);
  EXPECT_EQ(half.camera, same.camera.scaled(0.5));
  EXPECT_NE(half.note.find("640x480 px, the images have 320x240: scaled"), std::string::npos);
  const ChosenCamera odd = choose_camera(folder.path(), "", 427, 320);  // 320.25
  EXPECT_EQ(odd.camera.height_px, 320);
}

TEST(CameraChoice, RefusesAnotherAspectAndSwappedSides) {
  const TemporaryFolder folder;
  const std::string file = folder.write("camera.yaml", kCamera);
  const std::string aspect =
      error_of<ConfigError>([&] { choose_camera(folder.path(), "", 640, 360); });
  EXPECT_NE(aspect.find(file + ": width, height: is for 640x480 px, the images have 640x360"),
            std::string::npos)
      << aspect;
  EXPECT_NE(aspect.find("another aspect"), std::string::npos);
  const std::string swapped =
      error_of<ConfigError>([&] { choose_camera("/anywhere", file, 480, 640); });
  EXPECT_NE(swapped.find("swapped"), std::string::npos) << swapped;
}

TEST(CameraChoice, TakesTheFileBesideAVideoAndSaysSo) {
  const TemporaryFolder folder;
  const std::string video = folder.write("room.mp4", "");
  const ChosenCamera guessed = choose_camera(video, "", 640, 480);
  EXPECT_TRUE(guessed.is_guessed);
  EXPECT_NE(guessed.note.find("guessed (focal length 576 px)"), std::string::npos);
  folder.write("camera.yaml", kCamera);
  const ChosenCamera beside = choose_camera(video, "", 640, 480);
  EXPECT_FALSE(beside.is_guessed);
  EXPECT_EQ(beside.camera.fx_px, 525);
  EXPECT_NE(beside.note.find("beside the video"), std::string::npos);
  EXPECT_TRUE(choose_camera("/dev/video0", "", 640, 480).is_guessed);
}

}  // namespace
}  // namespace foresight
