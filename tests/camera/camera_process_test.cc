// The camera process on recorded folders, on a simulated clock.
#include <gtest/gtest.h>

#include "common/simulation.h"
#include "procs/camera/process.h"
#include "tests/camera/sequences.h"

namespace foresight {
namespace {

constexpr Time kStart{5'000'000'000};

class CameraProcessTest : public testing::Test {
 protected:
  CameraProcessTest() {
    params_.source = write_sequence(folder_, 10);
    world_.listen(Domain::kRobot, "IMAGE", [this](auto bytes) {
      image_t m;
      ASSERT_GT(m.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
      images_.push_back(m);
      arrivals_.push_back(world_.now());
      if (answers_) answer(m.utime);
    });
    world_.listen(Domain::kRobot, "CAMERA_INFO", [this](auto bytes) {
      ASSERT_GT(info_.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
      if (first_info_.us == 0) first_info_ = world_.now();
    });
  }
  // Slam takes 30 ms for a frame.
  void answer(int64_t utime) {
    camera_pose_t pose{};
    pose.utime = utime;
    world_.inject(world_.now() + milliseconds(30), Domain::kRobot, "CAMERA_POSE", encode(pose));
  }
  void run(Duration d) {
    world_.add("camera", {Domain::kRobot},
               [this](Node& node) { return std::make_unique<CameraProcess>(node, params_); });
    world_.run_until(world_.now() + d);
  }
  TemporaryFolder folder_;
  CameraParams params_;
  Simulation world_{kStart};
  std::vector<image_t> images_;
  std::vector<Time> arrivals_;
  camera_info_t info_{};
  Time first_info_{0};
  bool answers_ = false;
};

TEST_F(CameraProcessTest, PlaysAtTheRecordedPaceWithPresentStamps) {
  run(seconds(5));
  ASSERT_EQ(images_.size(), 10u);
  for (size_t i = 0; i < images_.size(); ++i) {
    EXPECT_EQ(images_[i].frame_number, static_cast<int>(i));
    EXPECT_EQ(images_[i].utime, arrivals_[i].us) << "as if captured when published";
    EXPECT_EQ((arrivals_[i] - arrivals_[0]).us, 100'000 * static_cast<int64_t>(i));
  }
  EXPECT_EQ(world_.node("camera").state(), ProcessState::kDone);
  EXPECT_FALSE(world_.is_stopped());
}

TEST_F(CameraProcessTest, GivesIntrinsicsBeforeTheFirstFrame) {
  run(seconds(5));
  EXPECT_LT(first_info_, arrivals_.at(0));
  EXPECT_EQ(info_.width_px, kWidth_px);
  EXPECT_EQ(info_.fx_px, 60);
}

TEST_F(CameraProcessTest, MayPlayFaster) {
  params_.speed = 4;
  run(seconds(5));
  ASSERT_EQ(images_.size(), 10u);
  EXPECT_EQ(arrivals_[9] - arrivals_[0], milliseconds(225));
}

TEST_F(CameraProcessTest, MayKeepTheRecordedStamps) {
  params_.stamps = Stamps::kOriginal;
  run(seconds(5));
  EXPECT_EQ(images_.at(3).utime, 100'300'000);
}

TEST_F(CameraProcessTest, StartsAtAFrameAndStopsAfterACount) {
  params_.first_frame = 4;
  params_.frame_count = 3;
  run(seconds(5));
  ASSERT_EQ(images_.size(), 3u);
  EXPECT_EQ(images_[0].frame_number, 4);
  EXPECT_EQ(world_.node("camera").state(), ProcessState::kDone);
}

TEST_F(CameraProcessTest, LoopsAtTheSamePaceWhateverTheStamps) {
  for (const Stamps stamps : {Stamps::kRebased, Stamps::kOriginal}) {
    images_.clear();
    arrivals_.clear();
    params_.loop = true;
    params_.first_frame = 2;
    params_.stamps = stamps;
    run(seconds(5));
    ASSERT_GT(images_.size(), 40u) << name_of(stamps);
    ASSERT_LT(images_.size(), 70u) << name_of(stamps) << ": it must not flood the bus";
    for (size_t i = 1; i < arrivals_.size(); ++i) {
      EXPECT_GE(arrivals_[i] - arrivals_[i - 1], milliseconds(33));
      EXPECT_LE(arrivals_[i] - arrivals_[i - 1], milliseconds(100));
    }
    EXPECT_EQ(images_[8].data, images_[0].data) << "each pass begins at first_frame";
    world_.remove("camera");
  }
}

TEST_F(CameraProcessTest, MayEndTheProcessAtTheEnd) {
  params_.exit_at_end = true;
  run(seconds(5));
  EXPECT_TRUE(world_.is_stopped());
}

TEST_F(CameraProcessTest, WaitsForSlamsAnswerWhenItIsToBeConsumed) {
  params_.pace = Pace::kConsumed;
  answers_ = true;
  run(seconds(2));
  ASSERT_EQ(images_.size(), 10u);
  for (size_t i = 1; i < arrivals_.size(); ++i) {
    EXPECT_EQ(arrivals_[i] - arrivals_[i - 1], milliseconds(30));
  }
}

TEST_F(CameraProcessTest, GoesOnWhenNobodyAnswers) {
  params_.pace = Pace::kConsumed;
  run(seconds(30));
  EXPECT_EQ(images_.size(), 10u) << "one frame every two seconds";
}

TEST_F(CameraProcessTest, ADamagedJpegIsCountedAndSkipped) {
  const TemporaryFolder folder;
  params_.source = write_sequence(folder, 5, "jpg");
  const std::string path = folder.path() + "/rgb/2.jpg";
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  run(seconds(0.35));
  EXPECT_EQ(world_.node("camera").state(), ProcessState::kDegraded);
  world_.run_until(world_.now() + seconds(5));
  EXPECT_EQ(images_.size(), 4u);
  EXPECT_EQ(world_.node("camera").state(), ProcessState::kDone);
}

TEST_F(CameraProcessTest, GuessesIntrinsicsAndSaysSo) {
  std::filesystem::remove(folder_.path() + "/camera.yaml");
  run(seconds(0.3));
  EXPECT_EQ(world_.node("camera").state(), ProcessState::kDegraded);
  EXPECT_NEAR(info_.fx_px, 0.9 * kWidth_px, 1e-9);
}

TEST_F(CameraProcessTest, RefusesToStartBehindTheEnd) {
  params_.first_frame = 10;
  EXPECT_NE(error_of<ConfigError>([&] { run(seconds(1)); }).find("first_frame"), std::string::npos);
}

TEST_F(CameraProcessTest, RefusesACameraFileOfAnotherAspect) {
  const TemporaryFolder other;
  params_.camera_file =
      other.write("camera.yaml",
                  "model: pinhole_radtan\nwidth: 640\nheight: 360\nfx: 600\nfy: 600\ncx: 310\n"
                  "cy: 230\nk1: 0\nk2: 0\np1: 0\np2: 0\nk3: 0\n");
  const std::string line = error_of<ConfigError>([&] { run(seconds(1)); });
  EXPECT_NE(line.find("640x360"), std::string::npos);
  EXPECT_NE(line.find("64x48"), std::string::npos);
}

TEST_F(CameraProcessTest, ScalesACameraFileOfAnotherResolution) {
  const TemporaryFolder other;
  params_.camera_file =
      other.write("camera.yaml",
                  "model: pinhole_radtan\nwidth: 640\nheight: 480\nfx: 600\nfy: 600\ncx: 310\n"
                  "cy: 230\nk1: 0\nk2: 0\np1: 0\np2: 0\nk3: 0\n");
  run(seconds(0.3));
  EXPECT_NEAR(info_.fx_px, 60, 1e-9);
  EXPECT_EQ(info_.width_px, kWidth_px);
}

// Images that cannot be used are left out, counted and named; the others are published.
TEST_F(CameraProcessTest, GoesOnAfterImagesThatCannotBeUsed) {
  std::filesystem::remove(folder_.path() + "/rgb/0.png");
  folder_.write("rgb/3.png", "");
  folder_.write("rgb/5.png", "no picture");
  cv::imwrite(folder_.path() + "/rgb/7.png", cv::Mat(20, 30, CV_8UC3, cv::Scalar::all(9)));
  for (const Pace pace : {Pace::kReal, Pace::kConsumed}) {
    images_.clear();
    params_.pace = pace;
    params_.exit_at_end = true;
    answers_ = params_.pace == Pace::kConsumed;
    auto& camera =
        static_cast<CameraProcess&>(world_.add("camera", {Domain::kRobot}, [this](Node& node) {
          return std::make_unique<CameraProcess>(node, params_);
        }));
    world_.run_until(world_.now() + seconds(5));
    EXPECT_EQ(images_.size(), 6u) << name_of(pace);
    EXPECT_EQ(camera.report().used(), 6);
    EXPECT_EQ(camera.report().refused(), 4);
    const std::string complaint = camera.report().complaint();
    for (const char* part : {"4 of 10 images", "rgb/0.png: does not exist", "rgb/3.png: is empty",
                             "rgb/5.png: cannot be read as an image"}) {
      EXPECT_NE(complaint.find(part), std::string::npos) << complaint;
    }
    EXPECT_EQ(world_.node("camera").state(), ProcessState::kDone);
    EXPECT_TRUE(world_.is_stopped());
    world_.remove("camera");
  }
}

TEST_F(CameraProcessTest, WithoutAUsableImageItDoesNotStart) {
  for (int i = 0; i < 10; ++i) folder_.write("rgb/" + std::to_string(i) + ".png", "");
  const std::string line = error_of<UnavailableError>([&] { run(seconds(1)); });
  EXPECT_NE(line.find("10 of 10 images"), std::string::npos) << line;
  EXPECT_NE(line.find("rgb/0.png: is empty"), std::string::npos) << line;
}

}  // namespace
}  // namespace foresight
