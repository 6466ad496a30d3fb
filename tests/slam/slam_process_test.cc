// The process on a simulated bus, with everything that cameras do to it. docs/algorithms/slam.md
// ("What it does when …") states the behaviour that is tested here.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/messages.h"
#include "common/simulation.h"
#include "foresight/health_t.hpp"
#include "foresight/pose_hint_t.hpp"
#include "foresight/slam_command_t.hpp"
#include "procs/slam/process.h"
#include "tests/common/files.h"
#include "tests/slam/synthetic_scene.h"

namespace foresight {
namespace {

constexpr Duration kPeriod = milliseconds(33);

class SlamProcessTest : public testing::Test {
 protected:
  SlamProcessTest() {
    world_.set_tap([this](Time, Domain, const std::string& channel, auto bytes) {
      const int size = static_cast<int>(bytes.size());
      if (channel == "CAMERA_POSE") {
        ASSERT_GT(pose_.decode(bytes.data(), 0, size), 0);
        ++poses_;
      }
      if (channel == "VIEW") ++views_;
      if (channel == "HEALTH") {
        ASSERT_GT(health_.decode(bytes.data(), 0, size), 0);
      }
    });
    SlamParams params;
    params.mapping_cost_s = 0.02;
    world_.add("slam", {Domain::kRobot},
               [&](Node& node) { return std::make_unique<SlamProcess>(node, params); });
    send_camera(camera_);
  }

  template <class Message>
  void send(const std::string& channel, const Message& message) {
    world_.inject(world_.now(), Domain::kRobot, channel, encode(message));
    world_.run_until(world_.now());
  }
  void send_camera(const CameraModel& camera) {
    send("CAMERA_INFO", to_message(camera, world_.now()));
  }
  void wait(Duration duration) { world_.run_until(world_.now() + duration); }
  void send_image(const cv::Mat& image, Time stamp) {
    image_t m{};
    m.utime = stamp.us;
    m.width_px = static_cast<int16_t>(image.cols);
    m.height_px = static_cast<int16_t>(image.rows);
    m.encoding = image_t::ENCODING_GRAY8;
    m.n_data = image.rows * image.cols;
    m.data.assign(image.data, image.data + m.n_data);
    send("IMAGE", m);
  }
  void step(const cv::Mat& image) {
    wait(kPeriod);
    send_image(image, world_.now() + clock_offset_);
  }
  void step(double t) { step(scene_.render(camera_, sideways_pose(t))); }
  void sweep(double from, double to, int count) {
    for (int i = 1; i <= count; ++i) step(from + (to - from) * i / count);
  }
  void start_map() {
    sweep(0, 0.6, 36);
    ASSERT_EQ(pose_.state, +camera_pose_t::STATE_TRACKING) << pose_.reason;
  }
  double metric(const std::string& name) const {
    for (int i = 0; i < health_.n_metrics; ++i) {
      const auto n = static_cast<size_t>(i);
      if (health_.metric_names[n] == name) return health_.metric_values[n];
    }
    ADD_FAILURE() << "no metric " << name;
    return -1;
  }
  int64_t rejected(const std::string& channel) const {
    for (const port_health_t& port : health_.ports) {
      if (port.channel == channel) return port.rejected;
    }
    ADD_FAILURE() << "no port " << channel;
    return -1;
  }
  void expect_tracking_in(int64_t epoch) {
    EXPECT_EQ(pose_.state, +camera_pose_t::STATE_TRACKING) << pose_.reason;
    EXPECT_EQ(pose_.epoch, epoch);
  }

  CameraModel camera_ = test_camera();
  SyntheticScene scene_{5};
  Simulation world_{Time{} + seconds(1000)};
  Duration clock_offset_;  // of the camera's clock
  camera_pose_t pose_{};
  health_t health_{};
  int poses_ = 0, views_ = 0;
};

TEST_F(SlamProcessTest, SaysWhyItWaitsBeforeThereIsAMap) {
  for (int i = 0; i < 35; ++i) step(0.0);
  EXPECT_EQ(pose_.state, +camera_pose_t::STATE_INITIALISING);
  EXPECT_NE(pose_.reason.find("the image moved"), std::string::npos) << pose_.reason;
  EXPECT_EQ(health_.state, +health_t::STATE_WAITING);
  EXPECT_NE(health_.reason.find("initialising: "), std::string::npos) << health_.reason;
}

TEST_F(SlamProcessTest, DroppedImagesCostNothing) {
  start_map();
  const int64_t epoch = pose_.epoch;
  for (int i = 1; i <= 8; ++i) {  // two of three are missing
    wait(kPeriod * 2);
    step(0.6 + 0.04 * i);
    expect_tracking_in(epoch);
  }
  wait(seconds(1.1));
  EXPECT_EQ(metric("losses"), 0);
}

TEST_F(SlamProcessTest, RepeatedImagesAreRejectedAndChangeNothing) {
  start_map();
  const int64_t epoch = pose_.epoch;
  const int before = poses_;
  const Time last = world_.now();
  for (int i = 0; i < 5; ++i) send_image(scene_.render(camera_, sideways_pose(0.6)), last);
  EXPECT_EQ(poses_, before);
  sweep(0.6, 0.7, 6);
  expect_tracking_in(epoch);
}

TEST_F(SlamProcessTest, AClockThatJumpsIsBelievedAfterASecond) {
  start_map();
  const int64_t epoch = pose_.epoch;
  clock_offset_ = seconds(3600);  // forward: at once
  step(0.6);
  expect_tracking_in(epoch);
  clock_offset_ = seconds(-3600);
  for (int i = 0; i < 45; ++i) step(0.6);
  expect_tracking_in(epoch);
  EXPECT_LT(pose_.utime, world_.now().us);
  const int views = views_;
  sweep(0.6, 0.7, 6);
  expect_tracking_in(epoch);
  EXPECT_GE(views_, views + 5);
}

TEST_F(SlamProcessTest, AnUnpluggedCameraIsNamedAndForgiven) {
  start_map();
  const int64_t epoch = pose_.epoch;
  wait(seconds(5));
  EXPECT_EQ(health_.state, +health_t::STATE_WAITING);
  EXPECT_EQ(health_.reason, "no IMAGE arrives");
  step(0.35);  // it was moved meanwhile
  expect_tracking_in(epoch);
}

TEST_F(SlamProcessTest, AnotherImageSizeNeedsAnotherCameraInfo) {
  start_map();
  const int64_t epoch = pose_.epoch;
  const int before = poses_;
  const CameraModel half = camera_.scaled(0.5);
  const cv::Mat image = scene_.render(half, sideways_pose(0.6));
  for (int i = 0; i < 65; ++i) step(image);
  EXPECT_EQ(poses_, before);
  EXPECT_EQ(health_.state, +health_t::STATE_WAITING);
  EXPECT_NE(health_.reason.find("has not the size"), std::string::npos) << health_.reason;
  send_camera(half);  // a different camera: a map of its own
  for (int i = 1; i <= 40; ++i) step(scene_.render(half, sideways_pose(0.6 + 0.02 * i)));
  EXPECT_EQ(pose_.state, +camera_pose_t::STATE_TRACKING) << pose_.reason;
  EXPECT_NE(pose_.epoch, epoch);
}

TEST_F(SlamProcessTest, BlackImagesAreALossThatTheNextImageEnds) {
  start_map();
  const int64_t epoch = pose_.epoch;
  const cv::Mat black(480, 640, CV_8UC1, cv::Scalar::all(0));
  for (int i = 0; i < 60; ++i) {
    step(black);
    ASSERT_EQ(pose_.state, +camera_pose_t::STATE_LOST);
  }
  EXPECT_EQ(health_.state, +health_t::STATE_DEGRADED);
  EXPECT_NE(health_.reason.find("lost for 1."), std::string::npos) << health_.reason;
  step(0.5);
  expect_tracking_in(epoch);
  wait(seconds(0.9));
  EXPECT_EQ(metric("relocalisations"), 1);
  EXPECT_EQ(health_.state, +health_t::STATE_OK);
  EXPECT_NE(health_.reason.find("relocalised after 2."), std::string::npos) << health_.reason;
}

TEST_F(SlamProcessTest, BelievesAHintOfThisMapOnly) {
  sweep(0, 0.3, 18);
  const auto earlier = read_pose(pose_);
  sweep(0.3, 0.6, 18);
  const auto known = read_pose(pose_);
  ASSERT_TRUE(earlier && known) << pose_.reason;
  const double mu_per_m =
      (known->translation() - earlier->translation()).norm() /
      (sideways_pose(0.6).translation() - sideways_pose(0.3).translation()).norm();
  const cv::Mat image = out_of_focus(scene_.render(camera_, sideways_pose(0.6) * bent_over()));
  const Pose<Map, Cam> there =
      *known * Pose<Cam, Cam>(bent_over().rotation(), mu_per_m * bent_over().translation());
  const auto state_after_hint = [&](int64_t epoch, double broken) {
    pose_hint_t hint{};
    hint.utime = world_.now().us;
    hint.epoch = epoch;
    write_pose(there, &hint);
    hint.map_from_cam_quat_wxyz[2] += broken;
    send("POSE_HINT", hint);
    step(image);
    return pose_.state;
  };
  step(image);
  ASSERT_EQ(pose_.state, +camera_pose_t::STATE_LOST);
  EXPECT_EQ(state_after_hint(pose_.epoch + 1, 0), +camera_pose_t::STATE_LOST);
  EXPECT_EQ(state_after_hint(pose_.epoch, NAN), +camera_pose_t::STATE_LOST);
  EXPECT_EQ(state_after_hint(pose_.epoch, 3), +camera_pose_t::STATE_LOST);  // no rotation
  EXPECT_EQ(state_after_hint(pose_.epoch, 0), +camera_pose_t::STATE_TRACKING) << pose_.reason;
  const auto found = read_pose(pose_);
  ASSERT_TRUE(found);
  EXPECT_LT((found->translation() - there.translation()).norm(), 0.01);
  wait(seconds(1.1));
  EXPECT_EQ(rejected("POSE_HINT"), 2);
}

TEST_F(SlamProcessTest, DamagedImagesAreRejected) {
  start_map();
  const int before = poses_;
  image_t m{};
  m.utime = world_.now().us + 1000;
  m.width_px = 640;
  m.height_px = 480;
  m.encoding = image_t::ENCODING_JPEG;
  m.data = {1, 2, 3};
  m.n_data = 3;
  send("IMAGE", m);
  EXPECT_EQ(poses_, before);
  sweep(0.6, 0.7, 6);
  EXPECT_EQ(pose_.state, +camera_pose_t::STATE_TRACKING) << pose_.reason;
}

// Too small a focal length, as a camera file of another lens has it.
TEST_F(SlamProcessTest, SaysThatTheFocalLengthIsWrongAndOnlyThen) {
  const CameraModel camera = camera_.scaled(0.5);
  for (const double factor : {1.0, 0.8}) {
    CameraModel given = camera;
    given.fx_px *= factor;
    given.fy_px *= factor;
    send_camera(given);
    for (int i = 0; i < 120; ++i) {
      step(scene_.render(camera, winding_pose(i / 100.0)));
      ASSERT_TRUE(factor != 1 || health_.state != +health_t::STATE_DEGRADED) << health_.reason;
    }
    wait(seconds(0.9));
    EXPECT_EQ(pose_.state, +camera_pose_t::STATE_TRACKING) << pose_.reason;
    EXPECT_EQ(health_.state, factor == 1 ? +health_t::STATE_OK : +health_t::STATE_DEGRADED);
    EXPECT_EQ(health_.reason.find("the images say that the focal length is") == 0, factor != 1)
        << health_.reason;
  }
}

class SlamOrderTest : public SlamProcessTest {
 protected:
  void order(int command, const std::string& folder) {
    slam_command_t m{};
    m.utime = world_.now().us;
    m.command = static_cast<int8_t>(command);
    m.folder = folder;
    send("SLAM_COMMAND", m);
    wait(seconds(1.5));  // the worker may be busy, and writes
  }
  TemporaryFolder temp_;
};

TEST_F(SlamOrderTest, SavesLoadsAndForgetsTheMap) {
  start_map();
  const int64_t epoch = pose_.epoch;
  order(slam_command_t::COMMAND_SAVE_MAP, temp_.path() + "/map");
  EXPECT_TRUE(std::filesystem::exists(temp_.path() + "/map/points3D.txt"));
  // A reset right after a save: what was there at the save is what is saved.
  slam_command_t save{};
  save.command = slam_command_t::COMMAND_SAVE_MAP;
  save.folder = temp_.path() + "/map";
  send("SLAM_COMMAND", save);
  order(slam_command_t::COMMAND_RESET_MAP, "");
  step(0.5);
  EXPECT_EQ(pose_.state, +camera_pose_t::STATE_INITIALISING);
  order(slam_command_t::COMMAND_LOAD_MAP, temp_.path() + "/map");
  step(0.5);
  EXPECT_EQ(pose_.state, +camera_pose_t::STATE_TRACKING) << pose_.reason;
  EXPECT_NE(pose_.epoch, epoch);
}

TEST_F(SlamOrderTest, NamesWhatItCannotLoadOrSaveAndTracksOn) {
  start_map();
  const int64_t epoch = pose_.epoch;
  order(slam_command_t::COMMAND_LOAD_MAP, temp_.path() + "/nothing");
  sweep(0.6, 0.7, 35);
  expect_tracking_in(epoch);
  EXPECT_EQ(health_.state, +health_t::STATE_DEGRADED);
  EXPECT_NE(health_.reason.find("nothing/foresight.txt"), std::string::npos) << health_.reason;
  order(slam_command_t::COMMAND_SAVE_MAP, "/proc/foresight");
  sweep(0.7, 0.8, 35);
  expect_tracking_in(epoch);
  EXPECT_NE(health_.reason.find("/proc/.foresight"), std::string::npos) << health_.reason;
  std::filesystem::create_directories(temp_.path() + "/precious");
  std::ofstream(temp_.path() + "/precious/letter.txt") << "dear";
  order(slam_command_t::COMMAND_SAVE_MAP, temp_.path() + "/precious");
  EXPECT_TRUE(std::filesystem::exists(temp_.path() + "/precious/letter.txt"));
  order(slam_command_t::COMMAND_SAVE_MAP, "relative");  // rejected: says nothing about files
  order(77, temp_.path());
  sweep(0.8, 0.9, 6);
  expect_tracking_in(epoch);
}

TEST_F(SlamOrderTest, SavesNoMapThatIsNotThere) {
  start_map();
  order(slam_command_t::COMMAND_SAVE_MAP, temp_.path() + "/map");
  order(slam_command_t::COMMAND_RESET_MAP, "");
  order(slam_command_t::COMMAND_SAVE_MAP, temp_.path() + "/map");
  for (int i = 0; i < 35; ++i) step(0.0);
  EXPECT_NE(health_.reason.find("no map to save"), std::string::npos) << health_.reason;
  order(slam_command_t::COMMAND_LOAD_MAP, temp_.path() + "/map");  // the first one is still there
  step(0.5);
  EXPECT_EQ(pose_.state, +camera_pose_t::STATE_TRACKING) << pose_.reason;
}

TEST_F(SlamOrderTest, DoesNotTakeTheMapOfAnotherCamera) {
  start_map();
  const int64_t epoch = pose_.epoch;
  order(slam_command_t::COMMAND_SAVE_MAP, temp_.path() + "/map");
  CameraModel other = camera_;
  other.fx_px += 1;
  send_camera(other);
  order(slam_command_t::COMMAND_LOAD_MAP, temp_.path() + "/map");
  sweep(0.0, 0.6, 70);
  EXPECT_EQ(pose_.state, +camera_pose_t::STATE_TRACKING) << pose_.reason;
  EXPECT_NE(pose_.epoch, epoch);
  EXPECT_NE(health_.reason.find("another camera"), std::string::npos) << health_.reason;
}

}  // namespace
}  // namespace foresight
