// Keyframes that add nothing go when a new one comes, and their points stay.
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "procs/slam/corner_detector.h"
#include "procs/slam/geometry.h"
#include "procs/slam/mapper.h"
#include "tests/slam/synthetic_scene.h"

namespace foresight::slam {
namespace {

constexpr int kFew = 9, kMany = 60;  // keyframes before the last one comes
constexpr int kPoints = 100;

class CullingTest : public testing::Test {
 protected:
  // Side by side, or each turned from the one before; points at depth 1 are seen by `observers` of
  // the keyframes in a row.
  void build(double apart, double turn_deg, int observers, int keyframes = kFew) {
    keyframes_ = keyframes;
    map_ = SlamMap();
    apart_ = apart;
    turn_deg_ = turn_deg;
    for (int i = 0; i < keyframes_; ++i) {
      Keyframe keyframe;
      keyframe.map_from_cam = pose_of(i);
      keyframe.pyramid = blank_;
      map_.add_keyframe(std::move(keyframe));
    }
    for (int n = 0; n < kPoints; ++n) {
      const Eigen::Vector3d point(0.05 * (n % 10) - 0.2, 0.05 * (n / 10) - 0.2, 1);
      const int first = observers < keyframes_ ? n % (keyframes_ - observers + 1) : 0;
      const Observation source = see(point, first + n % observers);
      const auto corner = make_corner(camera_, source.keyframe_id, {source.pixel, 0});
      const PointId id = map_.add_point(point, *corner);
      map_.confirm_point(id);
      for (int i = first; i < first + observers; ++i) map_.add_observation(id, see(point, i));
    }
  }

  Pose<Map, Cam> pose_of(int i) const {
    const Eigen::AngleAxisd turn(kDegree * turn_deg_ * i, Eigen::Vector3d::UnitZ());
    return {Eigen::Quaterniond(turn), {apart_ * i, 0, 0}};
  }

  Observation see(const Eigen::Vector3d& point, int keyframe) const {
    const Eigen::Vector3d in_cam = pose_of(keyframe).inverse() * point;
    const Eigen::Vector2d xy = in_cam.head<2>() / in_cam.z();
    return {KeyframeId(keyframe), 0, camera_.project(in_cam), xy, camera_.px_per_xy(xy)};
  }

  // Sees all points; returns which of the older keyframes are gone.
  std::vector<int32_t> gone_after_the_next() {
    TrackingAttempt tracking;
    tracking.map_from_cam = pose_of(keyframes_);
    for (const auto& [id, p] : map_.points()) {
      tracking.searched.push_back(id);
      tracking.inliers.push_back({id, see(p.position_in_map, keyframes_)});
    }
    Mapper mapper(camera_, SlamOptions{});
    mapper.insert_keyframe({Time{}, blank_, {}}, tracking, &map_);
    map_.validate();
    std::vector<int32_t> gone;
    for (int32_t id = 0; id < keyframes_; ++id) {
      if (map_.keyframe(KeyframeId(id)) == nullptr) gone.push_back(id);
    }
    return gone;
  }

  CameraModel camera_ = test_camera();
  ImagePyramid blank_ = build_pyramid(view_of(cv::Mat(480, 640, CV_8UC1, cv::Scalar::all(90))));
  int keyframes_ = kFew;
  double apart_ = 0, turn_deg_ = 0;
  SlamMap map_;
};

using Ids = std::vector<int32_t>;

TEST_F(CullingTest, ACrowdIsThinnedTwoAtATimeAndItsPointsStay) {
  build(0.004, 0, kFew);
  EXPECT_EQ(gone_after_the_next(), (Ids{1, 2}));  // the first holds the map's place
  EXPECT_EQ(map_.points().size(), static_cast<size_t>(kPoints));
  for (const auto& [id, p] : map_.points()) {
    EXPECT_NE(p.observation_in(p.source.keyframe_id), nullptr);
  }
}

TEST_F(CullingTest, KeyframesWithAPlaceOfTheirOwnStay) {
  build(0.012, 0, kFew);
  EXPECT_EQ(gone_after_the_next(), Ids{});
}

TEST_F(CullingTest, KeyframesThatLookElsewhereStay) {
  build(0.004, 20, kFew);
  EXPECT_EQ(gone_after_the_next(), Ids{});
}

TEST_F(CullingTest, KeyframesWhosePointsFewOthersSeeStay) {
  build(0.004, 0, 2);
  EXPECT_EQ(gone_after_the_next(), Ids{});
}

// Each with a place of its own, but six others see its points from within 5 degrees.
TEST_F(CullingTest, InALargeMapThoseThatOthersCoverGoTwoAtATime) {
  build(0.012, 0, kMany, kMany);
  EXPECT_EQ(gone_after_the_next().size(), 2u);
  EXPECT_EQ(map_.points().size(), static_cast<size_t>(kPoints));
}

TEST_F(CullingTest, InALargeMapThoseThatFewOthersCoverStay) {
  build(0.012, 0, 4, kMany);
  EXPECT_EQ(gone_after_the_next(), Ids{});
}

}  // namespace
}  // namespace foresight::slam
