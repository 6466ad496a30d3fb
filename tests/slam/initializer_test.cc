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
  EXPECT_FALSE(outcome.reason.empty());
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
