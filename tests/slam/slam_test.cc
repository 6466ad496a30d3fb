#include "procs/slam/slam.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include "tests/slam/synthetic_scene.h"

namespace foresight {
namespace {

// What a receiver of the deltas makes of them.
struct Receiver {
  std::map<KeyframeId, Eigen::Vector3d> keyframes;
  std::map<PointId, Eigen::Vector3f> points;
  std::set<MapObservation> observations;

  void apply(const MapDelta& delta) {
    for (const MapObservation& o : delta.observations_removed) {
      EXPECT_EQ(observations.erase(o), 1u);
    }
    for (const PointId id : delta.points_removed) {
      EXPECT_EQ(points.erase(id), 1u);
      std::erase_if(observations, [&](const MapObservation& o) { return o.point_id == id; });
    }
    for (const KeyframeId id : delta.keyframes_removed) keyframes.erase(id);
    for (const MapKeyframe& k : delta.keyframes_set) {
      keyframes[k.id] = k.map_from_cam.translation();
    }
    for (const MapPoint& p : delta.points_set) points[p.id] = p.position_in_map;
    for (const MapObservation& o : delta.observations_added) {
      EXPECT_TRUE(keyframes.contains(o.keyframe_id) && points.contains(o.point_id));
      observations.insert(o);
    }
  }
  bool operator==(const Receiver&) const = default;
};

class SlamTest : public testing::Test {
 protected:
  TrackingResult step(Slam* slam, const cv::Mat& image) {
    time_ = time_ + milliseconds(33);
    const TrackingResult result = slam->track(time_, view_of(image));
    while (auto job = slam->take_job()) slam->apply(Slam::run(std::move(*job)));
    return result;
  }
  TrackingResult step(Slam* slam, double t) {
    return step(slam, scene_.render(camera_, sideways_pose(t)));
  }
  // Moves from t = from to `to` in `count` images; returns the last result.
  TrackingResult sweep(Slam* slam, double from, double to, int count) {
    TrackingResult result;
    for (int i = 1; i <= count; ++i) result = step(slam, from + (to - from) * i / count);
    return result;
  }

  CameraModel camera_ = test_camera();
  SyntheticScene scene_{5};
  Time time_;
};

TEST_F(SlamTest, TracksToSubPixelAccuracy) {
  Slam slam(camera_, SlamOptions{});
  sweep(&slam, 0, 0.5, 30);
  const Pose<Map, Cam> a = sweep(&slam, 0.5, 0.6, 6).map_from_cam;
  const Pose<Map, Cam> b = sweep(&slam, 0.6, 0.8, 12).map_from_cam;
  const TrackingResult last = sweep(&slam, 0.8, 1.0, 12);
  ASSERT_EQ(last.state, TrackingState::kTracking) << last.reason;
  EXPECT_GT(last.quality, 0.6);
  // Ratio of two path lengths is free of the map's scale.
  const auto moved = [](double from, double to) {
    return (sideways_pose(from).inverse() * sideways_pose(to)).translation().norm();
  };
  const double ab = (b.translation() - a.translation()).norm();
  const double bc = (last.map_from_cam.translation() - b.translation()).norm();
  EXPECT_NEAR(bc / ab, moved(0.8, 1.0) / moved(0.6, 0.8), 0.03);
  const double turned = a.rotation().angularDistance(last.map_from_cam.rotation());
  EXPECT_NEAR(turned, sideways_pose(0.6).rotation().angularDistance(sideways_pose(1).rotation()),
              2e-3);
}

TEST_F(SlamTest, SameImagesGiveTheSameBytes) {
  const auto run = [&] {
    time_ = Time{};
    Slam slam(camera_, SlamOptions{});
    sweep(&slam, 0, 0.7, 40);
    (void)slam.take_delta();
    return slam.snapshot();
  };
  const MapDelta first = run(), second = run();
  ASSERT_GT(first.points_set.size(), 100u);
  ASSERT_EQ(first.points_set.size(), second.points_set.size());
  for (size_t i = 0; i < first.points_set.size(); ++i) {
    EXPECT_EQ(first.points_set[i].id, second.points_set[i].id);
    EXPECT_EQ(0, std::memcmp(first.points_set[i].position_in_map.data(),
                             second.points_set[i].position_in_map.data(), 3 * sizeof(float)));
  }
  EXPECT_EQ(first.observations_added, second.observations_added);
}

TEST_F(SlamTest, BlackImagesAreLostAndItComesBack) {
  Slam slam(camera_, SlamOptions{});
  ASSERT_EQ(sweep(&slam, 0, 0.6, 36).state, TrackingState::kTracking);
  const cv::Mat black(480, 640, CV_8UC1, cv::Scalar::all(0));
  for (int i = 0; i < 5; ++i) {
    const TrackingResult r = step(&slam, black);
    EXPECT_EQ(r.state, TrackingState::kLost);
    EXPECT_LT(r.quality, 0.1);
    EXPECT_FALSE(r.reason.empty());
  }
  const TrackingResult back = step(&slam, 0.4);
  EXPECT_EQ(back.state, TrackingState::kTracking) << back.reason;
  EXPECT_TRUE(back.relocalised);
  EXPECT_EQ(slam.statistics().losses, 1);
  EXPECT_EQ(slam.statistics().restarts, 0);
}

TEST_F(SlamTest, AHintIsNeitherNeededNorBelieved) {
  const cv::Mat black(480, 640, CV_8UC1, cv::Scalar::all(0));
  Slam slam(camera_, SlamOptions{});
  const Pose<Map, Cam> known = sweep(&slam, 0, 0.6, 36).map_from_cam;
  ASSERT_EQ(step(&slam, black).state, TrackingState::kLost);
  // Where it is not: the image decides.
  const Pose<Map, Cam> wrong(known.rotation(), known.translation() + Eigen::Vector3d(0.5, 0, 0));
  slam.hint(time_, wrong);
  TrackingResult back = step(&slam, 0.6);
  EXPECT_EQ(back.state, TrackingState::kTracking) << back.reason;
  EXPECT_LT((back.map_from_cam.translation() - known.translation()).norm(), 0.01);
  ASSERT_EQ(step(&slam, black).state, TrackingState::kLost);
  // Of another time: not even looked at.
  slam.hint(time_ - seconds(5), wrong);
  back = step(&slam, 0.6);
  EXPECT_EQ(back.state, TrackingState::kTracking) << back.reason;
  EXPECT_LT((back.map_from_cam.translation() - known.translation()).norm(), 0.01);
}

// Of no use where it is wrong, late or absent.
TEST_F(SlamTest, AHintFindsAViewThatNothingElseFinds) {
  Slam slam(camera_, SlamOptions{});
  const Pose<Map, Cam> earlier = sweep(&slam, 0, 0.3, 18).map_from_cam;
  const Pose<Map, Cam> known = sweep(&slam, 0.3, 0.6, 18).map_from_cam;
  const double mu_per_m =
      (known.translation() - earlier.translation()).norm() /
      (sideways_pose(0.6).translation() - sideways_pose(0.3).translation()).norm();
  const cv::Mat image = out_of_focus(scene_.render(camera_, sideways_pose(0.6) * bent_over()));
  const Pose<Map, Cam> there =
      known * Pose<Cam, Cam>(bent_over().rotation(), mu_per_m * bent_over().translation());
  for (int i = 0; i < 4; ++i) ASSERT_EQ(step(&slam, image).state, TrackingState::kLost);
  slam.hint(time_, known);
  EXPECT_EQ(step(&slam, image).state, TrackingState::kLost);
  slam.hint(time_ - seconds(5), there);
  EXPECT_EQ(step(&slam, image).state, TrackingState::kLost);
  slam.hint(time_, there);
  const TrackingResult found = step(&slam, image);
  EXPECT_EQ(found.state, TrackingState::kTracking) << found.reason;
  EXPECT_TRUE(found.relocalised);
  EXPECT_LT((found.map_from_cam.translation() - there.translation()).norm(), 0.01);
}

TEST_F(SlamTest, AForeignSceneIsNotTakenForTheMap) {
  Slam slam(camera_, SlamOptions{});
  ASSERT_EQ(sweep(&slam, 0, 0.6, 36).state, TrackingState::kTracking);
  const SyntheticScene foreign(99);
  for (int i = 0; i < 5; ++i) {
    const TrackingResult r = step(&slam, foreign.render(camera_, sideways_pose(0.6)));
    EXPECT_EQ(r.state, TrackingState::kLost);
    EXPECT_LT(r.quality, 0.25);
  }
}

TEST_F(SlamTest, NamesAFocalLengthThatIsNotTheOneGiven) {
  for (const double factor : {1.0, 0.8}) {
    CameraModel given = camera_;
    given.fx_px *= factor;
    given.fy_px *= factor;
    Slam slam(given, SlamOptions{});
    for (int i = 0; i < 120; ++i) {
      (void)step(&slam, scene_.render(camera_, winding_pose(i / 100.0)));
    }
    if (factor == 1) {
      EXPECT_EQ(slam.warning(), "");
      EXPECT_NEAR(slam.statistics().focal_factor, 1, 0.02);
    } else {
      EXPECT_NE(slam.warning().find("focal length is"), std::string::npos);
      // The map was built with the wrong one, which keeps a part of the error.
      EXPECT_GT(slam.statistics().focal_factor, 1.12);
      EXPECT_LT(slam.statistics().focal_factor, 1.35);
    }
  }
}

TEST_F(SlamTest, ForgetsTheLeastNeededWhenMemoryIsShortAndSaysSo) {
  SlamOptions options;
  options.memory_limit_mb = 4;
  Slam slam(camera_, options);
  const TrackingResult last = sweep(&slam, 0, 0.8, 50);
  EXPECT_EQ(last.state, TrackingState::kTracking) << last.reason;
  EXPECT_GT(slam.statistics().forgotten_keyframes, 0);
  EXPECT_NE(slam.warning().find("memory limit of 4 MB: "), std::string::npos) << slam.warning();
}

TEST_F(SlamTest, DeltasAddUpToTheSnapshot) {
  Slam slam(camera_, SlamOptions{});
  Receiver receiver;
  for (int i = 0; i < 60; ++i) {
    (void)step(&slam, i / 60.0);
    receiver.apply(slam.take_delta());
    Receiver from_snapshot;
    from_snapshot.apply(slam.snapshot());
    ASSERT_EQ(receiver, from_snapshot) << "image " << i;
  }
  EXPECT_GT(receiver.points.size(), 100u);
  EXPECT_GE(receiver.keyframes.size(), 4u);
}

TEST_F(SlamTest, AResultForAnOldEpochIsIgnored) {
  Slam slam(camera_, SlamOptions{});
  std::optional<MappingJob> job;
  for (int i = 0; i < 40 && !job; ++i) {
    time_ = time_ + milliseconds(33);
    (void)slam.track(time_, view_of(scene_.render(camera_, sideways_pose(i / 60.0))));
    job = slam.take_job();
  }
  ASSERT_TRUE(job);
  MappingResult late = Slam::run(std::move(*job));
  slam.reset("asked to");
  EXPECT_EQ(slam.epoch(), 1);
  slam.apply(std::move(late));
  EXPECT_TRUE(slam.snapshot().empty());
  const TrackingResult r = step(&slam, 0.0);
  EXPECT_EQ(r.state, TrackingState::kInitialising);
  EXPECT_NE(r.reason.find("asked to"), std::string::npos);
}

TEST_F(SlamTest, HostileInputIsAnsweredAndIgnored) {
  Slam slam(camera_, SlamOptions{});
  const cv::Mat small(100, 100, CV_8UC1, cv::Scalar::all(0));
  EXPECT_NE(slam.track(Time{1}, view_of(small)).reason.find("100 x 100"), std::string::npos);
  EXPECT_FALSE(slam.track(Time{2}, GrayImageView{nullptr, 640, 480, 640}).reason.empty());
  const cv::Mat good = scene_.render(camera_, sideways_pose(0));
  EXPECT_FALSE(slam.track(Time{3}, GrayImageView{good.data, 640, 480, 10}).reason.empty());
  (void)slam.track(Time{1000}, view_of(good));
  EXPECT_EQ(slam.track(Time{1000}, view_of(good)).reason, "image is not newer than the last one");
  EXPECT_EQ(slam.track(Time{-5}, view_of(good)).state, TrackingState::kInitialising);
  EXPECT_EQ(slam.track(Time{} - seconds(60), view_of(good)).reason.find("not newer"),
            std::string::npos);  // a new clock
}

}  // namespace
}  // namespace foresight
