// A hand that moves a camera freely in one room for many minutes: the map, and the carving made of
// it, follow the room and not the time. Without images: points are seen where they are.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "procs/carver/carver.h"
#include "procs/slam/corner_detector.h"
#include "procs/slam/mapper.h"
#include "procs/slam/published_map.h"
#include "tests/slam/synthetic_scene.h"

namespace foresight::slam {
namespace {

using Eigen::Vector3d;

constexpr int kImagesPerMinute = 180;
constexpr double kSeenWithin = 0.35;     // cosine of the angle to a surface's normal
constexpr double kFound = 0.85;          // share of the visible points
constexpr size_t kNewPerKeyframe = 150;  // points
constexpr double kFirstDepth_mu = 1.4;

struct SurfacePoint {
  Vector3d at, normal;
  PointId id{};  // in the map
};

// Three walls facing the camera, one behind the other, a table and two sides.
std::vector<SurfacePoint> furnished_room() {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(-1, 1);
  std::vector<SurfacePoint> points;
  for (int i = 0; i < 250; ++i) {
    for (const double depth : {1.2, 1.6, 2.0}) {
      points.push_back({{1.8 * u(random), 1.2 * u(random), depth}, -Vector3d::UnitZ()});
    }
    points.push_back({{1.8 * u(random), 0.7, 1.1 + 0.9 * u(random)}, -Vector3d::UnitY()});
    for (const double side : {-1.0, 1.0}) {
      points.push_back({{1.5 * side, 0.9 * u(random), 1.2 + 0.8 * u(random)},
                        Vector3d(-side, 0, -0.3).normalized()});
    }
  }
  return points;
}

// Within ±0.3 m and ±25 degrees. The periods have nothing in common: it is never where it was.
Pose<Map, Cam> wandering_pose(double time_s) {
  const auto wave = [&](double period_s, double other_s) {
    return 0.6 * std::sin(2 * M_PI * time_s / period_s) +
           0.4 * std::sin(2 * M_PI * time_s / other_s);
  };
  const double turn = 25 * M_PI / 180;
  const Eigen::Quaterniond q = Eigen::AngleAxisd(turn * wave(6.1, 9.7), Vector3d::UnitY()) *
                               Eigen::AngleAxisd(0.7 * turn * wave(7.3, 5.2), Vector3d::UnitX()) *
                               Eigen::AngleAxisd(0.7 * turn * wave(8.9, 6.7), Vector3d::UnitZ());
  return {q, {0.3 * wave(7.9, 5.7), 0.24 * wave(9.1, 6.3), 0.3 * wave(8.3, 10.3)}};
}

class Wandering : public testing::Test {
 protected:
  explicit Wandering(const SlamOptions& options = {})
      : mapper_(camera_, options), published_(camera_, options) {}

  struct Size {
    size_t keyframes = 0, points = 0;
    int64_t constraints = 0, carver_bytes = 0;
    int inserted = 0;  // in the time asked for
  };
  Size wander(int minutes) {
    Size size;
    for (int n = 0; n < minutes * kImagesPerMinute; ++n) size.inserted += take_image() ? 1 : 0;
    map_.validate();
    const CarverStatistics carved = carver_.statistics();
    return {map_.keyframes().size(), map_.points().size(), carved.constraints, carved.memory_bytes,
            size.inserted};
  }

  SlamMap map_;

 private:
  bool take_image() {
    const double time_s = 60.0 * ++images_ / kImagesPerMinute;
    const Time time{static_cast<int64_t>(1e6 * time_s)};
    TrackingAttempt tracking;
    tracking.map_from_cam = wandering_pose(time_s);
    tracking.quality = 0.9;
    std::vector<std::pair<SurfacePoint*, Observation>> unknown;
    look(&tracking, &unknown);
    if (!map_.empty() && !mapper_.wants_keyframe(map_, time, tracking)) return false;
    const KeyframeId id = insert(time, tracking);
    if (unknown.size() > kNewPerKeyframe) unknown.resize(kNewPerKeyframe);
    for (auto& [point, seen] : unknown) {
      const auto corner = make_corner(camera_, id, {seen.pixel, 0});
      if (corner) point->id = map_.add_point(point->at, *corner);
    }
    (void)carver_.apply(published_.take(&map_));
    return true;
  }

  void look(TrackingAttempt* tracking,
            std::vector<std::pair<SurfacePoint*, Observation>>* unknown) {
    const Pose<Cam, Map> cam_from_map = tracking->map_from_cam.inverse();
    for (SurfacePoint& point : room_) {
      const Vector3d in_cam = cam_from_map * point.at;
      const Vector3d ray = (point.at - tracking->map_from_cam.translation()).normalized();
      if (in_cam.z() < 0.1 || -ray.dot(point.normal) < kSeenWithin) continue;
      const Eigen::Vector2d pixel = camera_.project(in_cam);
      if (!camera_.in_image(pixel, 6) || chance_(random_) > kFound) continue;
      const Observation seen{KeyframeId(), 0, pixel, in_cam.head<2>() / in_cam.z(), camera_.fx_px};
      if (map_.point(point.id) == nullptr) {
        unknown->emplace_back(&point, seen);
      } else {
        tracking->searched.push_back(point.id);
        tracking->inliers.push_back({point.id, seen});
      }
    }
    std::sort(tracking->searched.begin(), tracking->searched.end());
    std::sort(tracking->inliers.begin(), tracking->inliers.end(),
              [](const PointMatch& a, const PointMatch& b) { return a.point_id < b.point_id; });
  }

  KeyframeId insert(Time time, const TrackingAttempt& tracking) {
    if (!map_.empty()) return mapper_.insert_keyframe({time, blank_, {}}, tracking, &map_);
    Keyframe first;
    first.time = time;
    first.map_from_cam = tracking.map_from_cam;
    first.pyramid = blank_;
    first.median_depth = kFirstDepth_mu;
    return map_.add_keyframe(std::move(first));
  }

  static CameraModel small_camera() {
    CameraModel camera = test_camera().scaled(0.5);
    camera.prepare();
    return camera;
  }

  const CameraModel camera_ = small_camera();
  const ImagePyramid blank_ =
      build_pyramid(view_of(cv::Mat(240, 320, CV_8UC1, cv::Scalar::all(90))));
  Mapper mapper_;
  PublishedMap published_;
  Carver carver_;
  std::vector<SurfacePoint> room_ = furnished_room();
  std::mt19937 random_{11};
  std::uniform_real_distribution<double> chance_{0, 1};
  int images_ = 0;
};

// By which share of it the second half of the time grew it.
template <class Count>
double growth(Count half, Count end) {
  return (static_cast<double>(end) - static_cast<double>(half)) / static_cast<double>(end);
}

TEST_F(Wandering, MapAndCarvingFollowTheRoomAndNotTheTime) {
  const Size early = wander(4);
  const Size half = wander(26);
  const Size end = wander(30);
  EXPECT_GT(half.keyframes, 60u);  // the room wants many views
  EXPECT_GT(half.points, 1000u);
  EXPECT_LT(growth(half.keyframes, end.keyframes), 0.1);
  EXPECT_LT(growth(half.points, end.points), 0.1);
  EXPECT_LT(growth(half.constraints, end.constraints), 0.1);
  EXPECT_LT(growth(half.carver_bytes, end.carver_bytes), 0.1);
  EXPECT_LT(end.inserted / 30, early.inserted / 4 / 5);  // a minute
  RecordProperty("keyframes_at_half", static_cast<int>(half.keyframes));
  RecordProperty("keyframes", static_cast<int>(end.keyframes));
  RecordProperty("carver_kilobytes_at_half", static_cast<int>(half.carver_bytes / 1000));
  RecordProperty("carver_kilobytes", static_cast<int>(end.carver_bytes / 1000));
}

class ShortOfMemory : public Wandering {
 protected:
  static constexpr double kLimit_mb = 10;
  static SlamOptions limited() {
    SlamOptions options;
    options.memory_limit_mb = kLimit_mb;
    return options;
  }
  ShortOfMemory() : Wandering(limited()) {}
};

TEST_F(ShortOfMemory, TheMapStaysBelowTheLimit) {
  wander(1);
  const Size size = wander(2);
  EXPECT_LT(1e-6 * static_cast<double>(map_.memory_bytes()), kLimit_mb);
  EXPECT_GT(1e-6 * static_cast<double>(map_.memory_bytes()), 0.8 * kLimit_mb);
  EXPECT_GT(size.points, 800u);  // what goes is seen by others
  EXPECT_NE(map_.keyframe(KeyframeId(0)), nullptr);
}

}  // namespace
}  // namespace foresight::slam
