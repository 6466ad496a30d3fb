// replay-log: a small synthetic session as two LCM logs (robot and operator side), and an arm as
// a third, the same bytes on every machine: cameras on an arc look at a bumpy wall and a box in
// front of it. Input of the replay tests.
#include <cmath>
#include <cstdio>
#include <map>
#include <random>

#include "common/arm_model.h"
#include "common/errors.h"
#include "common/image_codec.h"
#include "common/joint_reference.h"
#include "common/lcm_log.h"
#include "common/messages.h"
#include "common/node.h"
#include "common/robot_messages.h"
#include "foresight/arm_encoders_t.hpp"
#include "foresight/image_t.hpp"
#include "foresight/snapshot_request_t.hpp"
#include "foresight/view_t.hpp"

namespace foresight {
namespace {

constexpr int kKeyframes = 12;
constexpr int kPoints = 240;
constexpr Time kStart{1'000'000'000'000};
constexpr Duration kFramePeriod = milliseconds(100);
constexpr int64_t kEpoch = kStart.us;

CameraModel make_camera() {
  CameraModel camera;
  camera.width_px = 160;
  camera.height_px = 120;
  camera.fx_px = camera.fy_px = 140;
  camera.cx_px = 79.5;
  camera.cy_px = 59.5;
  camera.prepare();
  return camera;
}

// Plain arithmetic on raw draws: std distributions differ between libraries.
std::vector<MapPoint> make_points() {
  std::mt19937 random(5);
  const auto draw = [&] { return static_cast<double>(random() >> 8) / 16777216.0; };
  std::vector<MapPoint> points;
  for (int32_t i = 0; i < kPoints; ++i) {
    const double x = 3 * draw() - 1.5, y = 2.2 * draw() - 1.1;
    const bool on_box = std::abs(x) < 0.35 && std::abs(y) < 0.35;
    const double z = (on_box ? 1.4 : 2.2) + 0.05 * draw();
    points.push_back({PointId(i), Eigen::Vector3d(x, y, z).cast<float>()});
  }
  return points;
}

Pose<Map, Cam> camera_pose(int i) {
  const double s = static_cast<double>(i) / (kKeyframes - 1) - 0.5;
  return {Eigen::Quaterniond(std::cos(0.1 * s), 0, -std::sin(0.1 * s), 0),
          {0.9 * s, 0.1 * s * s, 0}};
}

Image make_picture(int i, const CameraModel& camera) {
  Image image{camera.width_px, camera.height_px, 3, {}};
  for (int y = 0; y < camera.height_px; ++y) {
    for (int x = 0; x < camera.width_px; ++x) {
      const int checker = (((x + 2 * i) / 10 + y / 10) % 2) * 90;
      for (int c = 0; c < 3; ++c) {
        image.bytes.push_back(static_cast<uint8_t>(60 + checker + (c == 0 ? x / 2 : c * y / 4)));
      }
    }
  }
  return image;
}

// Point i is seen by the keyframes in which it falls into the picture; new ones are added when
// first seen, and some are moved and removed on the way.
class Session {
 public:
  Session() : camera_(make_camera()), points_(make_points()), known_(points_.size(), false) {}

  MapDelta delta(int keyframe) {
    MapDelta d;
    d.keyframes_set.push_back(
        {KeyframeId(keyframe), camera_pose(keyframe), kStart + kFramePeriod * (keyframe + 1)});
    const Pose<Cam, Map> cam_from_map = camera_pose(keyframe).inverse();
    for (const MapPoint& p : points_) {
      if (removed_.contains(p.id)) continue;
      const Eigen::Vector3d in_cam = cam_from_map * p.position_in_map.cast<double>();
      const bool seen =
          camera_.in_image(camera_.project(in_cam)) && (p.id.value() + keyframe) % 3 != 0;
      if (!seen) continue;
      if (!known_[p.id.index()]) d.points_set.push_back(p);
      known_[p.id.index()] = true;
      d.observations_added.push_back({KeyframeId(keyframe), p.id});
    }
    if (keyframe == 5) move_points(&d);
    if (keyframe == 8) remove_points(&d);
    return d;
  }
  const CameraModel& camera() const { return camera_; }

 private:
  void move_points(MapDelta* d) {
    for (MapPoint& p : points_) {
      if (p.id.value() % 7 != 0 || !known_[p.id.index()]) continue;
      p.position_in_map.z() += 0.02f;
      d->points_set.push_back(p);
    }
  }
  void remove_points(MapDelta* d) {
    for (const MapPoint& p : points_) {
      if (p.id.value() % 11 != 0 || !known_[p.id.index()]) continue;
      std::erase_if(d->observations_added, [&](auto& o) { return o.point_id == p.id; });
      std::erase_if(d->points_set, [&](auto& q) { return q.id == p.id; });
      d->points_removed.push_back(p.id);
      removed_[p.id] = true;
    }
  }
  CameraModel camera_;
  std::vector<MapPoint> points_;
  std::vector<bool> known_;
  std::map<PointId, bool> removed_;
};

camera_pose_t pose_message(int i, Time time) {
  camera_pose_t pose{};
  pose.utime = time.us;
  pose.epoch = kEpoch;
  pose.state = camera_pose_t::STATE_TRACKING;
  pose.quality = 0.9f;
  pose.points_predicted = 100;
  pose.points_found = 90;
  write_pose(camera_pose(i), &pose);
  return pose;
}

void write_session(const std::string& prefix) {
  LogWriter robot(prefix + ".robot.lcmlog"), operator_side(prefix + ".operator.lcmlog");
  Session session;
  robot.write(kStart, "CAMERA_INFO", encode(to_message(session.camera(), kStart)));
  operator_side.write(kStart, "CAMERA_INFO", encode(to_message(session.camera(), kStart)));
  for (int i = 0; i < kKeyframes; ++i) {
    const Time time = kStart + kFramePeriod * (i + 1);
    for (map_delta_t& m : split(session.delta(i), kMaxDeltaBytes)) {
      m.utime = time.us;
      m.header.epoch = m.header.session = kEpoch;
      m.header.seq = i;
      m.header.is_snapshot = i == 0 ? 1 : 0;
      robot.write(time, "MAP_DELTA", encode(m));
    }
    const camera_pose_t pose = pose_message(i, time);
    robot.write(time, "CAMERA_POSE", encode(pose));
    view_t view{};
    view.utime = time.us;
    view.pose = pose;
    view.is_keyframe = 1;
    encode_raw(make_picture(i, session.camera()), &view.image);
    view.image.utime = time.us;
    view.image.frame_number = i;
    robot.write(time, "VIEW", encode(view));
    operator_side.write(time + milliseconds(50), "VIEW", encode(view));
  }
  snapshot_request_t request{};
  request.utime = kStart.us;
  request.channel = "CARVING_DELTA";
  request.requester = "test";
  robot.write(kStart + seconds(2), "SNAPSHOT_REQUEST", encode(request));
  robot.close();
  operator_side.close();
}

// An arm that stands at home, is commanded to and fro, and does exactly what its controller's
// reference asks.
void write_arm(const std::string& prefix) {
  LogWriter log(prefix + ".arm.lcmlog");
  const ArmModel arm = load_arm_file("deploy/arms/wam4.yaml");
  JointReference reference({1, 1});
  reference.rest(kStart, arm.home());
  for (int tick = 0; tick < 300; ++tick) {
    const Time time = kStart + milliseconds(2) * tick;
    if (tick % 17 == 0 && tick > 0) {
      joint_command_t command{};
      command.utime = (time - milliseconds(20)).us;
      command.session = kStart.us;
      command.seq = tick / 17;
      command.engaged = tick >= 34 && tick % 102 < 68 ? 1 : 0;
      JointVector target = arm.home();
      for (int i = 0; i < arm.size(); ++i) target[i] += (tick % 204 < 102 ? 0.1 : -0.1) / (i + 1);
      command.position_rad = write_joints(target);
      command.n_joints = static_cast<int32_t>(command.position_rad.size());
      log.write(time, "JOINT_COMMAND", encode(command));
      command.engaged != 0 ? reference.follow(time, target) : reference.stop(time);
    }
    arm_encoders_t reading{};
    reading.utime = time.us;
    reading.safety = arm_encoders_t::SAFETY_ACTIVE;
    const JointVector motor_rad = arm.motor_from_joint * reference.at(time).position_rad;
    for (int i = 0; i < arm.size(); ++i) {
      const double turns = motor_rad[i] / (2 * 3.14159265358979323846);
      reading.motor_counts.push_back(
          static_cast<int32_t>(std::lround(turns * arm.counts_per_revolution)));
    }
    reading.n_motors = arm.size();
    log.write(time, "ARM_ENCODERS", encode(reading));
  }
  log.close();
}

}  // namespace
}  // namespace foresight

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr,
                 "usage: replay-log PREFIX   writes PREFIX.robot.lcmlog, "
                 "PREFIX.operator.lcmlog and PREFIX.arm.lcmlog\n");
    return 64;
  }
  try {
    foresight::write_session(argv[1]);
    foresight::write_arm(argv[1]);
  } catch (const foresight::StartupError& e) {
    std::fprintf(stderr, "replay-log: %s\n", e.what());
    return e.code();
  }
  return 0;
}
