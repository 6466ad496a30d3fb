// What stands between the network and slam's core, without a network.
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "procs/slam/intrinsics_choice.h"
#include "procs/slam/image_stream.h"
#include "procs/slam/map_shelf.h"
#include "procs/slam/order_book.h"
#include "tests/slam/synthetic_scene.h"

namespace foresight {
namespace {

constexpr Time kStart{1'700'000'000'000'000};
constexpr Duration kPeriod = milliseconds(33);

// A camera at 30 Hz whose images arrive at once.
struct Camera {
  ImageVerdict next(int lost = 0) {
    now = now + kPeriod;
    number += 1 + lost;
    stream.count(now, now, number, 0);
    return stream.judge(now, now);
  }
  // How long until its images count again.
  Duration recovery() {
    const Time from = now;
    while (next() != ImageVerdict::kNext && now - from < seconds(60)) {
    }
    return now - from;
  }
  Time now = kStart;
  int32_t number = 0;
  ImageStream stream;
};

TEST(ImageStream, TheStreamThatKeepsComingWins) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 2000; ++i) {
    Camera camera;
    for (int k = 0; k < i % 3; ++k) static_cast<void>(camera.next());
    const int shift = static_cast<int>(random() % 64);
    for (int k = 0; k < 5; ++k) {
      const Time forged{static_cast<int64_t>(random()) >> shift};
      camera.stream.count(camera.now, forged, static_cast<int32_t>(random()), 0);
      static_cast<void>(camera.stream.judge(camera.now, forged));
    }
    EXPECT_LE(camera.recovery(), seconds(1.2));
    for (int k = 0; k < 10; ++k) EXPECT_EQ(camera.next(), ImageVerdict::kNext);
  }
}

TEST(ImageStream, ALongPauseIsNoJump) {
  Camera camera;
  static_cast<void>(camera.next());
  camera.now = camera.now + seconds(3600);
  EXPECT_EQ(camera.next(), ImageVerdict::kNext);
}

TEST(ImageStream, RecordedImagesMayComeFasterThanTheyWereTaken) {
  ImageStream stream;
  for (int i = 0; i < 1000; ++i) {
    EXPECT_EQ(stream.judge(kStart + milliseconds(3) * i, kStart + kPeriod * i),
              ImageVerdict::kNext);
  }
}

TEST(ImageStream, CountsGapsButNotWhatItPassedOverItself) {
  Camera camera;
  for (int i = 0; i < 10; ++i) static_cast<void>(camera.next(1));
  EXPECT_EQ(camera.stream.losses(camera.now).lost, 9);  // what was before the first is unknown
  camera.number += 8;
  camera.now = camera.now + kPeriod;
  camera.stream.count(camera.now, camera.now, camera.number, 7);
  EXPECT_EQ(camera.stream.losses(camera.now).lost, 9);
  EXPECT_EQ(camera.stream.losses(camera.now + seconds(6)).recently_lost, 0);
}

TEST(ImageStream, ALateImageWasNotLost) {
  Camera camera;
  for (int i = 0; i < 5; ++i) static_cast<void>(camera.next());
  const Time late = camera.now + milliseconds(1);
  static_cast<void>(camera.next(1));
  EXPECT_EQ(camera.stream.losses(camera.now).lost, 1);
  camera.stream.count(camera.now, late, camera.number - 1, 0);
  EXPECT_EQ(camera.stream.losses(camera.now).lost, 0);
  EXPECT_EQ(camera.stream.losses(camera.now).source_changes, 0);
}

TEST(IntrinsicsChoice, AChangeMustPersistAndFitTheImages) {
  const CameraModel first = test_camera(), other = first.scaled(0.5);
  IntrinsicsChoice choice;
  EXPECT_EQ(choice.offer(kStart, first), CameraVerdict::kNew);
  for (int second = 0; second < 10; ++second) {
    EXPECT_EQ(choice.offer(kStart + seconds(second), other), CameraVerdict::kDoubted);
    choice.saw_image(first.width_px, first.height_px);
  }
  EXPECT_EQ(choice.offer(kStart + seconds(10), first), CameraVerdict::kSame);
  for (int second = 11; second < 13; ++second) {
    EXPECT_EQ(choice.offer(kStart + seconds(second), other), CameraVerdict::kDoubted);
    choice.saw_image(other.width_px, other.height_px);
  }
  EXPECT_EQ(choice.offer(kStart + seconds(13), other), CameraVerdict::kNew);
  EXPECT_EQ(choice.camera(), other);
  EXPECT_EQ(choice.doubted(), 12);
}

TEST(IntrinsicsChoice, WhatIsOnlyAssumedYieldsToTheFirstStatement) {
  IntrinsicsChoice choice;
  choice.assume(test_camera());
  EXPECT_EQ(choice.offer(kStart, test_camera()), CameraVerdict::kSame);
  choice.assume(test_camera());
  EXPECT_EQ(choice.offer(kStart, test_camera().scaled(0.5)), CameraVerdict::kNew);
}

TEST(OrderBook, RemembersTheLastOrdersOnly) {
  OrderBook book;
  for (int64_t i = 0; i < 2000; ++i) book.note({i, 2, "map"}, {OrderOutcome::kDone, "done"});
  EXPECT_EQ(book.find({0, 2, "map"}), nullptr);
  ASSERT_NE(book.find({1999, 2, "map"}), nullptr);
  EXPECT_EQ(book.find({1999, 2, "lab"}), nullptr) << "another order of the same time";
}

TEST(MapShelf, NamesArePlain) {
  for (const char* good : {"map", "a", "Lab-3_v1.2", "0"}) EXPECT_EQ(find_name_trouble(good), "");
  for (const char* bad : {"", ".", "..", "a/b", "/a", "a..b", "_a", "-a", ".a", "a b", "a\n"}) {
    EXPECT_NE(find_name_trouble(bad), "") << bad;
  }
}

}  // namespace
}  // namespace foresight
