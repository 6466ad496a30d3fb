// A camera that stands still can give no map, whatever moves before it; what it carries in its view
// while it moves must not keep it from one.
#include "procs/slam/still_camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "procs/slam/geometry.h"
#include "procs/slam/slam.h"
#include "tests/slam/synthetic_scene.h"

namespace foresight {
namespace {

using Eigen::Vector3d;
using slam::kDegree;

const char* const kReason =
    "the picture changes only in parts: is something moving before a still camera?";
constexpr int kImages = 75;  // 2.5 s

CameraModel half_size() {
  CameraModel camera = test_camera().scaled(0.5);
  camera.prepare();
  return camera;
}

// A rectangle of its own texture, moved by hand: its middle, m, and its turn.
struct Thing {
  double width = 0.8, height = 0.6;  // m
  cv::Mat texture;

  TexturedPlane at(const Vector3d& middle, const Vector3d& turn) const {
    const Eigen::Quaterniond q = slam::rotation_from_vector(turn);
    const Vector3d right = q * Vector3d(width, 0, 0), down = q * Vector3d(0, height, 0);
    return {middle - 0.5 * (right + down), right, down, texture};
  }
};

class StillCameraTest : public testing::Test {
 protected:
  using ImageAt = std::function<cv::Mat(int)>;

  Thing thing(uint64_t seed, double width, double height) const {
    cv::RNG rng(seed);
    return {width, height, random_texture(&rng, 400)};
  }
  // A wall full of texture, or a plain one with an edge across it and a few things before it.
  static TexturedPlane wall(bool is_plain) {
    cv::RNG rng(5);
    cv::Mat texture = random_texture(&rng, 1600);
    if (is_plain) {
      texture.setTo(170);
      cv::rectangle(texture, {0, 520}, {1600, 560}, 90, cv::FILLED);
      cv::rectangle(texture, {380, 1020}, {480, 1120}, 60, cv::FILLED);
      for (const cv::Point at : {cv::Point(1120, 600),
                                 {430, 700},
                                 {470, 880},
                                 {1080, 1040},
                                 {1140, 800},
                                 {560, 1040},
                                 {960, 620},
                                 {380, 600}}) {
        cv::rectangle(texture, at, at + cv::Point(50, 40), 230, cv::FILLED);
      }
    }
    return {{-5, -4, 4}, {10, 0, 0}, {0, 8, 0}, texture};
  }
  // The thing at rest for ten images, then moved by a hand, before a wall.
  ImageAt moved_by_hand(const Thing& moved, bool is_plain) const {
    return [this, moved, is_plain](int i) {
      const double t = std::max(0, i - 10) / 30.0;
      const Vector3d middle(0.25 * std::sin(1.2 * t), 0.1 * std::sin(0.9 * t),
                            1.4 + 0.15 * std::sin(0.8 * t));
      const Vector3d turn(-0.4 + 0.2 * std::sin(0.7 * t), 0.25 * std::sin(1.1 * t), 0.3 * t);
      return SyntheticScene({wall(is_plain), moved.at(middle, turn)}).render(camera_, {});
    };
  }

  static cv::Mat noisy(const cv::Mat& image, double gain, double sigma, cv::RNG* rng) {
    cv::Mat noise(image.size(), CV_16S), sum;
    rng->fill(noise, cv::RNG::NORMAL, 0, sigma);
    cv::addWeighted(image, gain, noise, 1, 0, sum, CV_16S);
    sum.convertTo(sum, CV_8U);
    return sum;
  }

  TrackingResult step(const cv::Mat& image) {
    time_ = time_ + milliseconds(33);
    TrackingResult result = slam_->track(time_, view_of(image));
    while (auto job = slam_->take_job()) slam_->apply(Slam::run(std::move(*job)));
    return result;
  }

  // Returns how many images said why.
  int expect_no_map(const ImageAt& image_at, int images = kImages) {
    int said = 0;
    for (int i = 0; i < images; ++i) {
      const TrackingResult result = step(image_at(i));
      EXPECT_EQ(result.state, TrackingState::kInitialising) << "image " << i;
      if (result.state != TrackingState::kInitialising) break;
      said += result.reason.find(kReason) != std::string::npos ? 1 : 0;
    }
    EXPECT_EQ(slam_->statistics().published_points, 0);
    EXPECT_EQ(slam_->epoch(), 0);
    return said;
  }

  // Images until it tracks; it goes on tracking for a second.
  int images_until_tracking(const ImageAt& image_at, int images = kImages) {
    for (int i = 0; i < images; ++i) {
      if (step(image_at(i)).state != TrackingState::kTracking) continue;
      for (int later = i + 1; later <= i + 30; ++later) {
        EXPECT_EQ(step(image_at(later)).state, TrackingState::kTracking) << "image " << later;
      }
      EXPECT_EQ(slam_->epoch(), 0);
      return i;
    }
    return images;
  }

  CameraModel camera_ = half_size();
  SyntheticScene scene_{5};
  std::unique_ptr<Slam> slam_ = std::make_unique<Slam>(camera_, SlamOptions{});
  Time time_;
};

TEST_F(StillCameraTest, AHandMovesACloth) {
  EXPECT_GT(expect_no_map(moved_by_hand(thing(21, 1.6, 1.1), false)), 20);
}

// Hardly anything but the cloth has corners.
TEST_F(StillCameraTest, AHandMovesAClothOnAPlainTable) {
  EXPECT_GT(expect_no_map(moved_by_hand(thing(22, 1.1, 0.8), true)), 20);
}

// From left to right, near, over half of the height and more, its limbs swinging as one.
TEST_F(StillCameraTest, APersonWalksBy) {
  const Thing person = thing(23, 0.9, 2.4);
  expect_no_map([&](int i) {
    const Vector3d middle(-0.5 + 0.02 * i, 0.5 + 0.02 * std::sin(0.4 * i), 2.4);
    const Vector3d turn(0, 0.3 * std::sin(0.2 * i), 0.03 * std::sin(0.4 * i));
    return SyntheticScene({wall(true), person.at(middle, turn)}).render(camera_, {});
  });
}

TEST_F(StillCameraTest, NoiseFlickerAndExposure) {
  cv::RNG rng(4);
  const cv::Mat sharp = scene_.render(camera_, {});
  expect_no_map([&](int i) {
    return noisy(sharp, 1 + 0.25 * std::sin(0.1 * i) + 0.06 * std::sin(1.3 * i), 4, &rng);
  });
}

TEST_F(StillCameraTest, AHandMovesAClothInFlickeringLight) {
  cv::RNG rng(4);
  const ImageAt sharp = moved_by_hand(thing(21, 1.6, 1.1), false);
  EXPECT_GT(expect_no_map([&](int i) {
              return noisy(sharp(i), 0.8 + 0.15 * std::sin(0.1 * i) + 0.05 * std::sin(1.3 * i), 4,
                           &rng);
            }),
            20);
}

// What the screen shows was taken by a camera that moved.
TEST_F(StillCameraTest, AScreenShowsAFilm) {
  const SyntheticScene film(31);
  const cv::Mat desk = scene_.render(camera_, {});
  EXPECT_GT(expect_no_map([&](int i) {
              cv::Mat image = desk.clone(), small;
              cv::resize(film.render(camera_, sideways_pose(i / 60.0)), small, {250, 188}, 0, 0,
                         cv::INTER_AREA);
              small.copyTo(image(cv::Rect(35, 26, 250, 188)));
              return image;
            }),
            20);
}

// Boxes lie on it; a third of the picture is what stands beside it.
TEST_F(StillCameraTest, AConveyorBelt) {
  cv::RNG rng(41);
  const cv::Mat texture = random_texture(&rng, 1600);
  const Thing box = thing(42, 0.4, 0.4);
  EXPECT_GT(expect_no_map([&](int i) {
              const double x = -0.02 * i;
              const TexturedPlane belt = {{x - 2, -0.64, 2}, {8, 0, 0}, {0, 1.28, 0}, texture};
              return SyntheticScene({wall(false), belt, box.at({x + 0.3, 0.1, 1.8}, {0, 0, 0.2}),
                                     box.at({x + 1.2, -0.2, 1.7}, {0, 0, 0.1})})
                  .render(camera_, {});
            }),
            20);
}

TEST_F(StillCameraTest, AHandShakesBeforeTheLens) {
  const Thing hand = thing(51, 0.5, 0.38);
  expect_no_map([&](int i) {
    const Vector3d middle(0.03 * std::sin(0.3 * i), 0.02 * std::cos(0.23 * i), 0.5);
    const Vector3d turn(0.1 * std::sin(0.17 * i), 0.1 * std::cos(0.2 * i),
                        0.2 * std::sin(0.26 * i));
    return SyntheticScene({wall(false), hand.at(middle, turn)}).render(camera_, {});
  });
}

// Before a plain wall: as it comes in from the left it could as well be the world, and what is to
// the right of it be carried by the camera. When it has walked on it cannot.
TEST_F(StillCameraTest, AMapBeforeAStillCameraIsThrownAway) {
  const Thing person = thing(23, 0.9, 2.4);
  TrackingResult result;
  bool tracked = false, thrown_away = false;
  for (int i = 0; i < 90 && !thrown_away; ++i) {
    const Vector3d middle(-1.6 + 0.04 * i, 0.5 + 0.02 * std::sin(0.4 * i), 2.4);
    const Vector3d turn(0, 0.3 * std::sin(0.2 * i), 0.03 * std::sin(0.4 * i));
    result = step(SyntheticScene({wall(true), person.at(middle, turn)}).render(camera_, {}));
    tracked = tracked || result.state == TrackingState::kTracking;
    thrown_away = tracked && result.state == TrackingState::kInitialising;
  }
  EXPECT_TRUE(tracked);
  ASSERT_TRUE(thrown_away);
  EXPECT_EQ(slam_->epoch(), 1);
  EXPECT_NE(result.reason.find(kReason), std::string::npos) << result.reason;
  EXPECT_EQ(slam_->statistics().points, 0);
}

TEST_F(StillCameraTest, StartsWhenTheCameraMovesAfterAll) {
  const Thing cloth = thing(21, 1.6, 1.1);
  EXPECT_GT(expect_no_map(moved_by_hand(cloth, false), 60), 20);
  const TexturedPlane at_rest = cloth.at({0.2, 0.1, 1.4}, {-0.3, 0.2, 0.5});
  const SyntheticScene world({wall(false), at_rest});
  const auto moving = [&](int i) { return world.render(camera_, sideways_pose(i / 60.0)); };
  const int after_standing = images_until_tracking(moving);
  Slam fresh{camera_, SlamOptions{}};
  int alone = 0;
  for (TrackingResult r; alone < kImages && r.state != TrackingState::kTracking; ++alone) {
    const cv::Mat image = moving(alone);
    r = fresh.track(Time{} + milliseconds(33 * alone), view_of(image));
    while (auto job = fresh.take_job()) fresh.apply(Slam::run(std::move(*job)));
  }
  EXPECT_LE(after_standing, alone + 10);
}

// Fingers, a tool: carried by the camera, textured, up to a third of the view.
TEST_F(StillCameraTest, WhatTheCameraCarriesKeepsItFromNothing) {
  const std::vector<std::vector<std::vector<cv::Point>>> carried = {
      {{{60, 239}, {155, 120}, {165, 239}}, {{165, 239}, {170, 120}, {280, 239}}},
      {{{0, 100}, {110, 150}, {90, 239}, {0, 239}},
       {{319, 100}, {210, 150}, {230, 239}, {319, 239}}},
      {{{0, 170}, {319, 170}, {319, 239}, {0, 239}}}};
  cv::RNG rng(71);
  const cv::Mat texture = random_texture(&rng, 320)(cv::Rect(0, 0, 320, 240));
  for (const auto& outlines : carried) {
    cv::Mat mask(240, 320, CV_8U, cv::Scalar::all(0));
    cv::fillPoly(mask, outlines, 255);
    slam_ = std::make_unique<Slam>(camera_, SlamOptions{});
    EXPECT_LT(images_until_tracking([&](int i) {
                cv::Mat image = scene_.render(camera_, sideways_pose(i / 60.0));
                texture.copyTo(image, mask);
                return image;
              }),
              30);
  }
}

// An endoscope's.
TEST_F(StillCameraTest, ABlackRimKeepsItFromNothing) {
  cv::RNG rng(72);
  cv::Mat rim(240, 320, CV_8U, cv::Scalar::all(255));
  cv::circle(rim, {160, 120}, 130, 0, cv::FILLED);
  EXPECT_LT(images_until_tracking([&](int i) {
              cv::Mat image = scene_.render(camera_, sideways_pose(i / 60.0));
              image.setTo(12, rim);
              return noisy(image, 1, 1.5, &rng);
            }),
            30);
}

TEST_F(StillCameraTest, EvidenceOfACameraThatMoves) {
  const auto pyramid = [&](double t) {
    return slam::build_pyramid(view_of(scene_.render(camera_, sideways_pose(t))));
  };
  const Pose<World, Cam> first = sideways_pose(0), second = sideways_pose(0.1);
  const Pose<Cam, Cam> motion = second.inverse() * first;
  const auto moved = slam::still_evidence(camera_, {pyramid(0), pyramid(0.1), motion, 3});
  EXPECT_LE(moved.same, 3);
  EXPECT_GT(moved.changed, 150);
  EXPECT_FALSE(moved.says_still());
  // The same claim of two images of a camera that did not move.
  const auto still = slam::still_evidence(camera_, {pyramid(0), pyramid(0), motion, 3});
  EXPECT_EQ(still.changed, 0);
  EXPECT_GT(still.same, 150);
  EXPECT_TRUE(still.says_still());
  EXPECT_TRUE(still.confirms(still));
  EXPECT_FALSE(moved.confirms(still));
  // Without a claimed motion nothing can tell.
  const auto untold = slam::still_evidence(camera_, {pyramid(0), pyramid(0), {}, 3});
  EXPECT_EQ(untold.same + untold.changed, 0);
  EXPECT_FALSE(untold.says_still());
}

}  // namespace
}  // namespace foresight
