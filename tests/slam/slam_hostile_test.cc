// Messages that are well-formed and absurd: one bends nothing, the stream that keeps coming wins,
// and what is lost or contradicts itself is said.
#include <limits>

#include "common/snapshot_gate.h"
#include "foresight/snapshot_request_t.hpp"
#include "tests/slam/slam_process_fixture.h"

namespace foresight {
namespace {

constexpr int64_t kLargest = std::numeric_limits<int64_t>::max();
constexpr int64_t kSmallest = std::numeric_limits<int64_t>::min();

class SlamHostileTest : public SlamProcessTest {
 protected:
  void request_snapshot() {
    snapshot_request_t request{};
    request.utime = world_.now().us;
    request.channel = "MAP_DELTA";
    request.requester = "flood";
    world_.inject(world_.now(), Domain::kRobot, "SNAPSHOT_REQUEST", encode(request));
  }
  bool reason_has(const std::string& words) const {
    return health_.reason.find(words) != std::string::npos;
  }
};

TEST_F(SlamHostileTest, FourThousandSnapshotRequestsAreTwoAnswersASecond) {
  start_map();
  wait(seconds(2));
  const int before = snapshots_, poses = poses_;
  for (int i = 0; i < 100; ++i) {
    for (int k = 0; k < 40; ++k) request_snapshot();
    step(0.6);
  }
  const int intervals = static_cast<int>(100 * kPeriod.seconds() / kSnapshotInterval.seconds());
  EXPECT_GE(snapshots_ - before, intervals);
  EXPECT_LE(snapshots_ - before, intervals + 1);
  EXPECT_EQ(poses_ - poses, 100);
  wait(seconds(1.1));
  const int answered = snapshots_;
  wait(seconds(2));
  EXPECT_EQ(snapshots_, answered) << "nobody asks any more";
  request_snapshot();
  wait(milliseconds(1));
  EXPECT_EQ(snapshots_, answered + 1) << "a single one is answered at once";
}

TEST_F(SlamHostileTest, OneForgedCameraInfoBendsNothing) {
  start_map();
  const int64_t epoch = pose_.epoch;
  CameraModel forged = camera_;
  forged.fx_px = forged.fy_px = 300;
  send_camera(forged);
  send_camera(forged);
  send_camera(forged);
  sweep(0.6, 0.7, 12);
  expect_tracking_in(epoch);
  wait(seconds(0.9));
  EXPECT_EQ(metric("camera_infos_doubted"), 3);
  EXPECT_EQ(health_.state, +health_t::STATE_DEGRADED);
  EXPECT_TRUE(reason_has("CAMERA_INFO contradicts itself")) << health_.reason;
  send_camera(camera_);
  wait(seconds(5));
  sweep(0.7, 0.8, 40);
  expect_tracking_in(epoch);
  EXPECT_EQ(health_.state, +health_t::STATE_OK) << health_.reason;
}

TEST_F(SlamHostileTest, TwoCamerasAreDegradedHealthAndNoNewMap) {
  start_map();
  const int64_t epoch = pose_.epoch;
  CameraModel other = camera_;
  other.cx_px += 20;
  for (int i = 0; i < 20; ++i) {  // each at 1 Hz, and one much more often
    send_camera(camera_);
    for (int k = 0; k < 15; ++k) {
      send_camera(other);
      step(0.6);
    }
  }
  expect_tracking_in(epoch);
  EXPECT_EQ(health_.state, +health_t::STATE_DEGRADED);
  EXPECT_TRUE(reason_has("two cameras")) << health_.reason;
}

TEST_F(SlamHostileTest, AFirstCameraInfoThatWasForgedIsCorrected) {
  world_.remove("slam");
  add_slam(std::nullopt);
  CameraModel forged = camera_;
  forged.width_px = 320;
  send_camera(forged);
  for (int i = 0; i < 4; ++i) {
    send_camera(camera_);
    for (int k = 0; k < 30; ++k) step(0.0);
  }
  sweep(0, 0.6, 40);
  EXPECT_EQ(pose_.state, +camera_pose_t::STATE_TRACKING) << pose_.reason;
}

// What a stamp can be, before the first image and within the stream.
TEST_F(SlamHostileTest, OneImageWithAnAbsurdStampDoesNotEndTheStream) {
  start_map();
  const int64_t epoch = pose_.epoch;
  const cv::Mat image = scene_.render(camera_, sideways_pose(0.6));
  const int64_t hour_us = 3'600'000'000;
  for (const int64_t us : {kLargest, kSmallest, int64_t{9'000'000'000'000'000'000}, int64_t{-1},
                           int64_t{0}, world_.now().us + hour_us, world_.now().us - hour_us}) {
    const int before = poses_;
    send_image(image, Time{us});
    EXPECT_EQ(poses_, before) << us;
    sweep(0.6, 0.62, 3);
    EXPECT_EQ(poses_, before + 3) << us;
    expect_tracking_in(epoch);
  }
}

TEST_F(SlamHostileTest, AForgedFirstImageIsForgottenInASecond) {
  world_.remove("slam");
  add_slam(std::nullopt);
  send_camera(camera_);
  send_image(scene_.render(camera_, sideways_pose(0)), world_.now() + seconds(1e9));
  for (int i = 0; i < 32; ++i) step(0.0);
  const int before = poses_;
  for (int i = 0; i < 3; ++i) step(0.0);
  EXPECT_EQ(poses_, before + 3);
  EXPECT_EQ(pose_.utime, world_.now().us);
}

TEST_F(SlamHostileTest, ForgedImagesBetweenTheRealOnesNeverCount) {
  start_map();
  const int64_t epoch = pose_.epoch;
  const cv::Mat image = scene_.render(camera_, sideways_pose(0.6));
  const int before = poses_;
  for (int i = 0; i < 60; ++i) {
    send_image(image, world_.now() + seconds(100 + i));
    step(0.6);
    EXPECT_EQ(pose_.utime, world_.now().us);
  }
  EXPECT_EQ(poses_, before + 60);
  expect_tracking_in(epoch);
}

TEST_F(SlamHostileTest, AbsurdHintsAreRefused) {
  start_map();
  pose_hint_t hint{};
  hint.epoch = pose_.epoch;
  hint.map_from_cam_quat_wxyz[0] = 1;
  for (const int64_t us : {kLargest, kSmallest, int64_t{0}}) {
    hint.utime = us;
    send("POSE_HINT", hint);
  }
  hint.utime = world_.now().us;
  hint.map_from_cam_position_mu[0] = 1e300;
  send("POSE_HINT", hint);
  wait(seconds(1.1));
  EXPECT_EQ(rejected("POSE_HINT"), 4);
}

TEST_F(SlamHostileTest, LostImagesAreCountedAndSaid) {
  start_map();
  wait(seconds(0.9));
  EXPECT_EQ(metric("images_lost"), 0);
  for (int i = 0; i < 60; ++i) {
    if (i % 4 == 3) ++frame_number_;  // every fifth image is lost
    step(0.6);
  }
  for (int i = 0; i < 32; ++i) step(0.6);  // until the next health
  EXPECT_EQ(metric("images_lost"), 15);
  EXPECT_NEAR(metric("images_lost_share"), 15.0 / 143, 0.01);  // those of start_map() too
  EXPECT_EQ(health_.state, +health_t::STATE_DEGRADED);
  EXPECT_TRUE(reason_has("images lost in the last 5 s")) << health_.reason;
  for (int i = 0; i < 180; ++i) step(0.6);
  EXPECT_EQ(health_.state, +health_t::STATE_OK) << health_.reason;
}

TEST_F(SlamHostileTest, ACameraThatStartsAnewLosesNothing) {
  start_map();
  frame_number_ = 0;
  sweep(0.6, 0.7, 12);
  frame_number_ = std::numeric_limits<int32_t>::max() - 100;  // nor does an absurd number
  sweep(0.7, 0.8, 12);
  wait(seconds(0.9));
  EXPECT_EQ(metric("images_lost"), 0);
  EXPECT_EQ(metric("image_source_changes"), 2);
  EXPECT_EQ(health_.state, +health_t::STATE_OK) << health_.reason;
}

TEST_F(SlamHostileTest, RepeatedImagesAreCounted) {
  start_map();
  const Time last = world_.now();
  --frame_number_;
  for (int i = 0; i < 5; ++i) {
    send_image(scene_.render(camera_, sideways_pose(0.6)), last);
    --frame_number_;
  }
  frame_number_ += 1;
  sweep(0.6, 0.7, 6);
  wait(seconds(0.9));
  EXPECT_EQ(metric("images_repeated"), 5);
  EXPECT_EQ(metric("images_lost"), 0);
}

TEST_F(SlamHostileTest, TwoSourcesOfImagesAreSaid) {
  start_map();
  for (int i = 0; i < 30; ++i) {
    const int32_t own = frame_number_;
    frame_number_ = 1'000'000 + i;
    send_image(scene_.render(camera_, sideways_pose(0.6)), world_.now() + seconds(100 + i));
    frame_number_ = own;
    step(0.6);
  }
  wait(seconds(0.9));
  EXPECT_EQ(health_.state, +health_t::STATE_DEGRADED);
  EXPECT_TRUE(reason_has("two cameras publish IMAGE")) << health_.reason;
}

}  // namespace
}  // namespace foresight
