#include "procs/slam/initializer.h"

#include <gtest/gtest.h>

#include "procs/slam/geometry.h"
#include "tests/slam/synthetic_scene.h"

namespace foresight::slam {
namespace {

class InitializerTest : public testing::Test {
 protected:
  // Feeds `count` images; returns the last outcome, or the first with a map.
  template <class PoseAt>
  Initializer::Outcome feed(int count, const PoseAt& pose_at) {
    Initializer::Outcome outcome;
    for (int i = 0; i < count && !outcome.map; ++i) {
      const cv::Mat image = scene_.render(camera_, pose_at(i));
      outcome = answer(Time{} + milliseconds(33 * i), image);
    }
    return outcome;
  }

  Initializer::Outcome answer(Time time, const cv::Mat& image) {
    Initializer::Outcome outcome;
    outcome.reason = initializer_.feed(time, build_pyramid(view_of(image)));
    if (auto attempt = initializer_.take_attempt()) {
      outcome = initializer_.apply(Initializer::run(std::move(*attempt)));
    }
    return outcome;
  }

  static cv::Mat noisy(const cv::Mat& image, double sigma, cv::RNG* rng) {
    cv::Mat noise(image.size(), CV_16S), sum;
    rng->fill(noise, cv::RNG::NORMAL, 0, sigma);
    cv::add(image, noise, sum, cv::noArray(), CV_8U);
    return sum;
  }

  CameraModel camera_ = test_camera();
  SyntheticScene scene_{11};
  Initializer initializer_{camera_, SlamOptions{}};
};

TEST_F(InitializerTest, WaitsWhileTheCameraStandsStill) {
  const auto outcome = feed(12, [](int) { return Pose<World, Cam>(); });
  EXPECT_FALSE(outcome.map);
  EXPECT_NE(outcome.reason.find("the image moved 0.0 px"), std::string::npos) << outcome.reason;
}

TEST_F(InitializerTest, RefusesAPureRotation) {
  const auto outcome = feed(25, [](int i) {
    return Pose<World, Cam>(rotation_from_vector({0.003 * i, 0.006 * i, 0.004 * i}),
                            Eigen::Vector3d::Zero());
  });
  EXPECT_FALSE(outcome.map);
  EXPECT_TRUE(outcome.reason.starts_with("parallax 0.0 deg, need")) << outcome.reason;
}

TEST_F(InitializerTest, NoiseIsNoMotion) {
  cv::RNG rng(8);
  Initializer::Outcome outcome;
  for (int i = 0; i < 40 && !outcome.map; ++i) {
    outcome = answer(Time{} + milliseconds(33 * i), noisy(scene_.render(camera_, {}), 3, &rng));
  }
  EXPECT_FALSE(outcome.map);
  EXPECT_NE(outcome.reason.find("the image moved 0."), std::string::npos) << outcome.reason;
}

// Brighter on one side, and passed by: corners, if there are any, are noise.
TEST_F(InitializerTest, ABlankWallGivesNoMap) {
  cv::RNG rng(9);
  cv::Mat wall(480, 640, CV_8UC1);
  for (const double sigma : {3, 10}) {
    initializer_.restart();
    for (int i = 0; i < 30; ++i) {
      for (int x = 0; x < 640; ++x) wall.col(x).setTo(90 + (x + 4 * i) / 16);
      const auto outcome = answer(Time{} + milliseconds(33 * i), noisy(wall, sigma, &rng));
      ASSERT_FALSE(outcome.map);
      const bool said = sigma == 3 ? outcome.reason == "0 corners, need 80"
                                   : outcome.reason.ends_with("tracks left: new reference image");
      EXPECT_TRUE(said || i == 0) << outcome.reason;
    }
  }
}

// Before it can tell, it must not: a wall passed by looks like a turn at first.
TEST_F(InitializerTest, SaysThatATurnWouldExplainAWallSoFar) {
  const SyntheticScene wall = SyntheticScene::wall(3);
  Initializer::Outcome outcome;
  int like_a_turn = 0;
  for (int i = 0; i < 20 && !outcome.map; ++i) {
    const Pose<World, Cam> pose(Eigen::Quaterniond::Identity(), {0.01 * i, 0, 0});
    outcome = answer(Time{} + milliseconds(33 * i), wall.render(camera_, pose));
    like_a_turn += outcome.reason.starts_with("a pure rotation explains the tracks") ? 1 : 0;
  }
  EXPECT_GE(like_a_turn, 2);
  EXPECT_TRUE(outcome.map) << outcome.reason;
}

// An answer that is good enough is refused once a different motion comes close to it.
TEST_F(InitializerTest, SaysThatTwoMotionsFitAboutEqually) {
  Initializer::Outcome outcome;
  for (int i = 0; i < 40 && !outcome.map; ++i) {
    const cv::Mat image = scene_.render(camera_, sideways_pose(i / 60.0));
    (void)initializer_.feed(Time{} + milliseconds(33 * i), build_pyramid(view_of(image)));
    auto attempt = initializer_.take_attempt();
    if (!attempt) continue;
    const Initializer::Answer clear = Initializer::run(std::move(*attempt));
    if (clear.solutions.empty()) continue;
    Initializer::Answer doubtful = clear;
    TwoViewSolution other = clear.solutions.front();
    const Pose<Cam, Cam>& motion = other.second_from_first;
    other.second_from_first = {motion.rotation(), {0, 0, motion.translation().norm()}};
    other.cost *= 1.2;
    doubtful.solutions.push_back(other);
    const Initializer::Outcome refused = initializer_.apply(doubtful);
    EXPECT_FALSE(refused.map);
    outcome = initializer_.apply(clear);
    if (!outcome.map) continue;
    EXPECT_EQ(refused.reason, "two motions explain the tracks about equally well");
  }
  EXPECT_TRUE(outcome.map) << outcome.reason;
}

// The rotation's own direction and speed must not matter, nor a lens that is not quite as the
// camera file says.
TEST_F(InitializerTest, RefusesFastRotationsThroughAnImperfectLens) {
  CameraModel lens = camera_;
  lens.fx_px *= 1.02;
  lens.fy_px *= 1.02;
  for (const Eigen::Vector3d& axis :
       {Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(1, 0.3, 0), Eigen::Vector3d(0.1, 0.2, 1)}) {
    initializer_.restart();
    Initializer::Outcome outcome;
    for (int i = 0; i < 25 && !outcome.map; ++i) {
      const cv::Mat image =
          scene_.render(lens, {rotation_from_vector(0.008 * i * axis), Eigen::Vector3d::Zero()});
      outcome = answer(Time{} + milliseconds(33 * i), image);
    }
    EXPECT_FALSE(outcome.map) << axis.transpose();
    EXPECT_TRUE(outcome.reason.starts_with("a pure rotation explains the tracks") ||
                outcome.reason.starts_with("parallax 0."))
        << outcome.reason;
  }
}

// A plane seen from two places allows two motions; whatever is accepted has to be the true one.
TEST_F(InitializerTest, NeverTakesAPlanesWrongTwin) {
  int accepted = 0;
  for (const uint64_t seed : {3u, 4u, 5u, 6u}) {
    const SyntheticScene wall = SyntheticScene::wall(seed);
    for (const Eigen::Vector3d& way : {Eigen::Vector3d(0.5, 0, 0), Eigen::Vector3d(0.1, 0.05, 0.5),
                                       Eigen::Vector3d(-0.3, 0.3, 0.2)}) {
      initializer_.restart();
      const auto pose_at = [&](double i) {
        const Eigen::AngleAxisd tilt(0.35, Eigen::Vector3d(1, 0.4, 0).normalized());
        return Pose<World, Cam>(Eigen::Quaterniond(tilt), i / 40 * way);
      };
      Initializer::Outcome outcome;
      for (int i = 0; i < 40 && !outcome.map; ++i) {
        outcome = answer(Time{} + milliseconds(33 * i), wall.render(camera_, pose_at(i)));
      }
      if (!outcome.map) continue;
      ++accepted;
      const double last = static_cast<double>(outcome.map->second.time.us) / 33e3;
      const Pose<Cam, Cam> truth = pose_at(0).inverse() * pose_at(last);
      EXPECT_LT(angle_between(truth.translation(), outcome.map->second.map_from_cam.translation()) /
                    kDegree,
                15)
          << "wall " << seed << ", way " << way.transpose();
    }
  }
  EXPECT_GT(accepted, 0);
}

// The camera stands still; half of the view is an object that moves.
TEST_F(InitializerTest, RefusesAMovingObjectInFrontOfAStillCamera) {
  const SyntheticScene object(21);
  Initializer::Outcome outcome;
  for (int i = 0; i < 40 && !outcome.map; ++i) {
    cv::Mat image = scene_.render(camera_, {});
    const cv::Rect half(320, 0, 320, 480);
    object.render(camera_, sideways_pose(i / 60.0))(half).copyTo(image(half));
    outcome = answer(Time{} + milliseconds(33 * i), image);
  }
  EXPECT_FALSE(outcome.map);
}

TEST_F(InitializerTest, BuildsTheTrueSceneFromABaseline) {
  const auto outcome = feed(40, [](int i) { return sideways_pose(i / 60.0); });
  ASSERT_TRUE(outcome.map) << outcome.reason;
  const InitialMap& map = *outcome.map;
  EXPECT_GE(map.points.size(), 150u);
  // Up to scale, each point lies on one of the planes z = 4, 3, 2.2 m.
  const Pose<Cam, Cam> truth = sideways_pose(0).inverse() *
                               sideways_pose(static_cast<double>(map.second.time.us) / 33e3 / 60);
  const double scale = truth.translation().norm() / map.second.map_from_cam.translation().norm();
  EXPECT_LT(angle_between(truth.translation(), map.second.map_from_cam.translation()) / kDegree,
            3.0);
  int on_a_plane = 0;
  for (const InitialMap::PointInit& p : map.points) {
    const double z = scale * p.position_in_map.z();
    for (const double plane : {4.0, 3.0, 2.2}) on_a_plane += std::abs(z / plane - 1) < 0.08;
  }
  EXPECT_GT(on_a_plane, 0.9 * static_cast<double>(map.points.size()));
}

TEST_F(InitializerTest, SaysThatABlankImageHasNoCorners) {
  const cv::Mat blank(480, 640, CV_8UC1, cv::Scalar::all(70));
  const auto outcome = answer(Time{}, blank);
  EXPECT_FALSE(outcome.map);
  EXPECT_EQ(outcome.reason, "0 corners, need 80");
}

}  // namespace
}  // namespace foresight::slam
