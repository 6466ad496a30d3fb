// What is taken for a loop and what is not: two visits of a place, mapped without any error but the
// drift that a test gives the second one.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include "procs/slam/corner_detector.h"
#include "procs/slam/features.h"
#include "procs/slam/geometry.h"
#include "procs/slam/loop_closer.h"
#include "tests/slam/synthetic_scene.h"

namespace foresight::slam {
namespace {

constexpr double kWay = 40;  // from the first visit to the second, m; a fifth of it can be drift
constexpr int kViews = 6;    // of each visit

// About the second visit's last camera.
struct Drift {
  double scale = 1, turn_deg = 0, shift_m = 0;
};

// A wall 3 m away that is seen from z = 0 about x = `at`, with a poster in its middle.
void add_wall(double at, const cv::Mat& wall, const cv::Mat& poster,
              std::vector<TexturedPlane>* planes) {
  planes->push_back({{at - 4, -3, 3}, {8, 0, 0}, {0, 6, 0}, wall});
  planes->push_back({{at - 1.1, -0.9, 2.9}, {2.2, 0, 0}, {0, 1.8, 0}, poster});
}

class LoopGatesTest : public testing::Test {
 protected:
  LoopGatesTest() : camera_(test_camera().scaled(0.5)) { camera_.prepare(); }

  static Pose<World, Cam> pose_at(double at, int view) {
    const Eigen::AngleAxisd turn(0.02 * view, Eigen::Vector3d::UnitY());
    return {Eigen::Quaterniond(turn), {at - 0.2 + 0.08 * view, 0.02 * view, 0}};
  }

  // `drift` is where the map has what the visit sees.
  void visit(const SyntheticScene& scene, double at, const Similarity<Map, World>& drift) {
    const int32_t first = map_.empty() ? 0 : map_.newest_keyframe().id.value() + 1;
    for (int view = 0; view < kViews; ++view) {
      const Pose<World, Cam> pose = pose_at(at, view);
      Keyframe keyframe;
      keyframe.map_from_cam = drift * pose;
      keyframe.pyramid = build_pyramid(view_of(scene.render(camera_, pose)));
      keyframe.thumbnail = make_thumbnail(keyframe.pyramid);
      keyframe.features = detect_features(keyframe.pyramid);
      keyframe.median_depth = 3 * drift.scale();
      map_.add_keyframe(std::move(keyframe));
    }
    for (const int source : {0, 2, 5}) add_points(scene, at, first, source, drift);
  }

  void add_points(const SyntheticScene& scene, double at, int32_t first, int source,
                  const Similarity<Map, World>& drift) {
    const Pose<World, Cam> pose = pose_at(at, source);
    OccupancyMask occupied(camera_.width_px, camera_.height_px);
    const Keyframe& keyframe = *map_.keyframe(KeyframeId(first + source));
    for (const PointId id : keyframe.point_ids) {
      occupied.add(map_.point(id)->observation_in(keyframe.id)->pixel, 6);
    }
    for (const DetectedCorner& c : detect_corners(keyframe.pyramid, 150, &occupied)) {
      const auto corner = make_corner(camera_, keyframe.id, c);
      const auto in_world = scene.point_at(camera_, pose, c.pixel);
      if (!corner || !in_world) continue;
      const PointId id = map_.add_point(drift * *in_world, *corner);
      map_.confirm_point(id);
      for (int n = 0; n < 20; ++n) map_.count_prediction(id, true);
      for (int view = 0; view < kViews; ++view) {
        if (view != source)
          observe(scene, pose_at(at, view), *in_world, KeyframeId(first + view), id, c.level);
      }
    }
  }

  void observe(const SyntheticScene& scene, const Pose<World, Cam>& pose,
               const Eigen::Vector3d& in_world, KeyframeId keyframe_id, PointId point_id,
               int level) {
    const Eigen::Vector2d pixel = camera_.project(pose.inverse() * in_world);
    if (!camera_.in_image(pixel, 8)) return;
    const auto seen = scene.point_at(camera_, pose, pixel);
    if (!seen || (*seen - in_world).norm() > 0.01) return;  // something is in front of it
    const Eigen::Vector2d xy = camera_.unproject(pixel);
    map_.add_observation(point_id, {keyframe_id, level, pixel, xy, camera_.px_per_xy(xy)});
  }

  // Both visits; the second one at `again`.
  void visit_twice(const SyntheticScene& scene, double again, const Drift& drift) {
    map_ = SlamMap();
    visit(scene, 0, {});
    const Eigen::Vector3d about = pose_at(again, kViews - 1).translation();
    const Eigen::Quaterniond turn(
        Eigen::AngleAxisd(drift.turn_deg * kDegree, Eigen::Vector3d(0.2, 1, 0.1).normalized()));
    drifted_ = {drift.scale, turn,
                about + Eigen::Vector3d(0, 0, drift.shift_m) - drift.scale * (turn * about)};
    visit(scene, again, drifted_);
    map_.validate();
  }

  // With all that is similar already known.
  LoopSearch search() const {
    LoopSearch search;
    search.keyframe_id = KeyframeId(2 * kViews - 1);
    for (int id = 2 * kViews - 1; id >= kViews; --id) search.new_side.push_back(KeyframeId(id));
    search.old_sides.push_back({{}, kWay});
    for (int id = kViews - 1; id >= 0; --id) {
      search.old_sides.back().keyframe_ids.push_back(KeyframeId(id));
    }
    search.map = map_;
    return search;
  }

  std::optional<LoopClosure> find(const LoopSearch& search) const {
    return find_loop(camera_, SlamOptions{}, search);
  }

  bool is_loop(const Drift& drift) {
    visit_twice(scene_, 0, drift);
    return find(search()).has_value();
  }

  cv::RNG rng_{17};
  cv::Mat wall_ = random_texture(&rng_, 960), poster_ = random_texture(&rng_, 320);
  cv::Mat plain_{8, 8, CV_8UC1, cv::Scalar::all(120)};
  static std::vector<TexturedPlane> walls(double at, const cv::Mat& wall, const cv::Mat& poster) {
    std::vector<TexturedPlane> planes;
    add_wall(at, wall, poster, &planes);
    return planes;
  }
  SyntheticScene scene_{walls(0, wall_, poster_)};
  CameraModel camera_;
  SlamMap map_;
  Similarity<Map, World> drifted_;
};

TEST_F(LoopGatesTest, ThePlaceIsRecognisedAndTheDriftIsMeasured) {
  visit_twice(scene_, 0, {1.1, 5, 0.3});
  PlaceIndex places;
  places.follow(map_);
  const auto similar = loop_search(map_, places, KeyframeId(2 * kViews - 1));
  ASSERT_TRUE(similar);
  EXPECT_LT(similar->old_sides.at(0).keyframe_ids.at(0), KeyframeId(kViews));
  const auto closure = find(search());
  ASSERT_TRUE(closure);
  EXPECT_EQ(closure->new_side.size(), static_cast<size_t>(kViews));
  EXPECT_LT(closure->rms_px, 0.5);
  EXPECT_NEAR(closure->old_from_new.scale(), 1 / 1.1, 0.003);
  const Eigen::Vector3d poster(0, 0, 3);
  EXPECT_LT((closure->old_from_new * (drifted_ * poster) - poster).norm(), 0.01);
}

TEST_F(LoopGatesTest, ADriftThatTheWayCannotHaveCausedIsNone) {
  EXPECT_TRUE(is_loop({1, 25, 0}));
  EXPECT_FALSE(is_loop({1, 35, 0}));
  EXPECT_TRUE(is_loop({1.8, 0, 0}));
  EXPECT_FALSE(is_loop({2.2, 0, 0}));
  EXPECT_TRUE(is_loop({0.55, 0, 0}));
  EXPECT_FALSE(is_loop({0.45, 0, 0}));
  EXPECT_TRUE(is_loop({1, 0, 0.18 * kWay}));
  EXPECT_FALSE(is_loop({1, 0, 0.22 * kWay}));
}

TEST_F(LoopGatesTest, TwoViewsAreTooFew) {
  visit_twice(scene_, 0, {});
  LoopSearch few = search();
  few.new_side.resize(3);
  EXPECT_TRUE(find(few));
  few.new_side.resize(2);
  EXPECT_FALSE(find(few));
}

// The walls are near enough to each other to be one wall that has drifted.
TEST_F(LoopGatesTest, TheSamePosterOnAnotherWallIsAnotherPlace) {
  const double apart = 0.15 * kWay;
  for (const bool poster_alone_first : {true, false}) {
    std::vector<TexturedPlane> planes;
    add_wall(0, poster_alone_first ? plain_ : wall_, poster_, &planes);
    add_wall(apart, poster_alone_first ? wall_ : plain_, poster_, &planes);
    visit_twice(SyntheticScene(planes), apart, {});
    EXPECT_FALSE(find(search())) << poster_alone_first;
  }
}

TEST_F(LoopGatesTest, AnIdenticalWallFarAwayIsAnotherPlace) {
  std::vector<TexturedPlane> planes;
  add_wall(0, wall_, poster_, &planes);
  add_wall(kWay / 2, wall_, poster_, &planes);
  visit_twice(SyntheticScene(planes), kWay / 2, {});
  EXPECT_FALSE(find(search()));
}

}  // namespace
}  // namespace foresight::slam
