// A camera that walks round a room and comes back; through other lenses as well.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "procs/slam/slam.h"
#include "tests/slam/synthetic_scene.h"

namespace foresight {
namespace {

constexpr int kImagesPerLap = 280;
constexpr Duration kPeriod = milliseconds(33);

double lap_at(Time time) { return (time - Time{}).seconds() / kPeriod.seconds() / kImagesPerLap; }

CameraModel small_camera() {
  CameraModel camera = test_camera().scaled(0.5);
  camera.prepare();
  return camera;
}

// 115 degrees wide, 145 across the diagonal.
CameraModel fisheye_camera() {
  CameraModel camera = small_camera();
  camera.lens = LensModel::kEquidistant;
  camera.fx_px = camera.fy_px = 160;
  camera.distortion = {-0.02, 0.004, 0, 0, 0};
  camera.prepare();
  return camera;
}

// As a barrel as cheap wide lenses are.
CameraModel barrel_camera() {
  CameraModel camera = small_camera();
  camera.distortion = {-0.28, 0.09, 0.0006, -0.0004, -0.012};
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
      ((m.topLeftCorner<3, 3>() * in_map).colwise() + m.topRightCorner<3, 1>()) - in_world;
  return std::sqrt(off.squaredNorm() / static_cast<double>(n));
}

// How far apart the map puts the last image and the first lap's keyframe that stood where it was
// taken, beyond what is true: what a loop leaves open. Degrees.
double seam_deg(const StoredMap& map, Time time, const Pose<Map, Cam>& map_from_cam) {
  const Pose<World, Cam> truth = ring_pose(lap_at(time));
  double nearest = 1e9, seam = 0;
  for (const StoredMap::Keyframe& k : map.keyframes) {
    const Pose<World, Cam> there = ring_pose(lap_at(k.time));
    const double apart = (there.translation() - truth.translation()).norm();
    if (lap_at(k.time) > 0.5 || apart > nearest) continue;
    nearest = apart;
    const Eigen::Quaterniond found = k.map_from_cam.rotation().inverse() * map_from_cam.rotation();
    seam = found.angularDistance(there.rotation().inverse() * truth.rotation()) * 180 / M_PI;
  }
  return seam;
}

struct Walk {
  int first_image = -1;  // with a pose
  int lost = 0;
  double least_quality = 1;
  double error_m = 0;
  double seam_deg = 0;
  SlamStatistics statistics;
};

// So many laps; `given` is what the core believes of the camera.
Walk walk(double laps, const CameraModel& camera, const CameraModel& given,
          const SlamOptions& options = {}, const SyntheticScene& scene = SyntheticScene::room(7)) {
  Slam slam(given, options);
  Walk result;
  for (int i = 1; i <= laps * kImagesPerLap; ++i) {
    const Time time = Time{} + kPeriod * i;
    const TrackingResult r =
        slam.track(time, view_of(scene.render(camera, ring_pose(lap_at(time)))));
    while (auto job = slam.take_job()) slam.apply(Slam::run(std::move(*job)));
    (void)slam.take_delta();
    if (r.state == TrackingState::kLost) ++result.lost;
    if (r.state != TrackingState::kTracking) continue;
    if (result.first_image < 0) result.first_image = i;
    if (i + 1 > laps * kImagesPerLap) {
      result.seam_deg = seam_deg(slam.stored_map(), time, r.map_from_cam);
    }
    if (i > kImagesPerLap / 4) result.least_quality = std::min(result.least_quality, r.quality);
  }
  result.statistics = slam.statistics();
  result.error_m = keyframe_error_m(slam.stored_map());
  return result;
}

TEST(Loop, ComesBackToWhereItWas) {
  const Walk result = walk(1.2, small_camera(), small_camera());
  EXPECT_EQ(result.lost, 0);
  EXPECT_LT(result.error_m, 0.003);  // of a way of 5 m
}

// A focal length that is 3 % off makes a lap end 11 degrees from its beginning: what was mapped at
// first is not where it is looked for. No map can be right then; a closed one agrees with itself.
TEST(Loop, IsClosedWhereTheMapHasDrifted) {
  CameraModel given = small_camera();
  given.fx_px *= 1.03;
  given.fy_px *= 1.03;
  SlamOptions open;
  open.close_loops = false;
  const Walk closed = walk(1.2, small_camera(), given);
  const Walk left_open = walk(1.2, small_camera(), given, open);
  EXPECT_EQ(closed.lost, 0);
  EXPECT_GE(closed.statistics.loops, 1);
  EXPECT_EQ(left_open.statistics.loops, 0);
  EXPECT_GT(left_open.seam_deg, 5);
  EXPECT_LT(closed.seam_deg, 0.5);
  EXPECT_LT(closed.statistics.points, 0.95 * left_open.statistics.points);  // none of them twice
}

// Each wall is the picture of the one before.
TEST(Loop, IsNotSeenInWallsThatLookAlike) {
  const CameraModel camera = small_camera();
  const Walk result = walk(0.55, camera, camera, {}, SyntheticScene::room_of_equal_walls(7));
  EXPECT_EQ(result.statistics.loops, 0);
  EXPECT_EQ(result.lost, 0);
  EXPECT_LT(result.error_m, 0.005);
}

TEST(Lens, FisheyeAndBarrelAreTrackedToTheirEdges) {
  for (const CameraModel& camera : {fisheye_camera(), barrel_camera()}) {
    const Walk result = walk(0.4, camera, camera);
    EXPECT_GE(result.first_image, 0);
    EXPECT_LT(result.first_image, 30);
    EXPECT_EQ(result.lost, 0);
    EXPECT_GT(result.least_quality, 0.8);
    EXPECT_LT(result.error_m, 0.005);
    EXPECT_GT(result.statistics.published_points, 400);
  }
}

}  // namespace
}  // namespace foresight
