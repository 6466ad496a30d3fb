// A camera that walks round a room and comes back.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>

#include "procs/slam/slam.h"
#include "tests/slam/synthetic_scene.h"

namespace foresight {
namespace {

constexpr int kImagesPerLap = 280;
constexpr Duration kPeriod = milliseconds(33);

double lap_at(Time time) {
  return (time - Time{}).seconds() / kPeriod.seconds() / kImagesPerLap;
}

CameraModel small_camera() {
  CameraModel camera = test_camera().scaled(0.5);
  camera.prepare();
  return camera;
}

// Root mean square distance of the map's keyframes from the truth, after a similarity; m.
double keyframe_error_m(const StoredMap& map) {
  const auto n = static_cast<Eigen::Index>(map.keyframes.size());
  Eigen::Matrix3Xd in_map(3, n), in_world(3, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const StoredMap::Keyframe& k = map.keyframes[static_cast<size_t>(i)];
    in_map.col(i) = k.map_from_cam.translation();
    in_world.col(i) = ring_pose(lap_at(k.time)).translation();
  }
  const Eigen::Matrix4d m = Eigen::umeyama(in_map, in_world, true);
  const Eigen::Matrix3Xd off =
      (m.topLeftCorner<3, 3>() * in_map).colwise() + m.topRightCorner<3, 1>() - in_world;
  return std::sqrt(off.squaredNorm() / static_cast<double>(n));
}

class LoopTest : public testing::Test {
 protected:
  TrackingResult step(double lap) {
    time_ = time_ + kPeriod;
    const cv::Mat image = scene_.render(camera_, ring_pose(lap_at(time_)));
    const TrackingResult result = slam_.track(time_, view_of(image));
    while (auto job = slam_.take_job()) slam_.apply(Slam::run(std::move(*job)));
    return result;
  }

  CameraModel camera_ = small_camera();
  SyntheticScene scene_ = SyntheticScene::room(7);
  CameraModel given() { CameraModel c = camera_; c.fx_px *= atof(getenv("F")); c.fy_px *= atof(getenv("F")); return c; }
  Slam slam_{given(), opt()};
  SlamOptions opt() { SlamOptions o; if (getenv("NOLOOP")) o.close_loops = false; return o; }
  Time time_;
};

TEST_F(LoopTest, ComesBackToWhereItWas) {
  std::map<int, Pose<Map, Cam>> first_lap;
  int lost = 0, compared = 0;
  for (int i = 0; i < kImagesPerLap * 5 / 4; ++i) {
    const TrackingResult r = step(static_cast<double>(i) / kImagesPerLap);
    lost += r.state == TrackingState::kLost;
    if (i % 20 == 0) {
      const auto s = slam_.statistics();
      if (i > 40) printf("ate %.4f  ", keyframe_error_m(slam_.stored_map()));
      printf("%d q %.2f kf %d points %d loops %d %s\n", i, r.quality, s.keyframes, s.points, s.loops, r.reason.c_str());
    }
    if (r.state != TrackingState::kTracking) continue;
    if (i < kImagesPerLap) { first_lap[i] = r.map_from_cam; continue; }
    const auto before = first_lap.find(i - kImagesPerLap);
    if (before == first_lap.end()) continue;
    ++compared;
    if (i % 5 == 0) printf("%d %.3f %.2f deg (lap %.3f)\n", i, (before->second.translation() - r.map_from_cam.translation()).norm(),
      before->second.rotation().angularDistance(r.map_from_cam.rotation()) * 57.3,
      (first_lap.at(140).translation() - r.map_from_cam.translation()).norm());
  }
  EXPECT_EQ(lost, 0);
  EXPECT_GT(compared, 30);
  EXPECT_GE(slam_.statistics().loops, 1);
}

}  // namespace
}  // namespace foresight
