// The process on a simulated bus, with everything that cameras do to it. docs/algorithms/slam.md
// ("What it does when …") states the behaviour that is tested here.
#include "tests/slam/slam_process_fixture.h"

namespace foresight {
namespace {

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
  for (const double offset_s : {3600.0, -3600.0}) {
    clock_offset_ = seconds(offset_s);
    const int before = poses_;
    step(0.6);
    EXPECT_EQ(poses_, before) << "a single image";
    for (int i = 0; i < 45; ++i) step(0.6);
    expect_tracking_in(epoch);
    EXPECT_EQ(pose_.utime, (world_.now() + clock_offset_).us);
  }
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
  change_camera(half, sideways_pose(0.6));  // a map of its own
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
    change_camera(given, winding_pose(0));
    wait(seconds(6));  // the change itself is doubted for a while
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

}  // namespace
}  // namespace foresight
