#include "tests/fuzz/robot_line.h"

#include <cmath>

#include "common/delta_input.h"
#include "common/message_bytes.h"
#include "foresight/joint_state_t.hpp"
#include "procs/calibrator/process.h"
#include "procs/carver/process.h"
#include "procs/mesher/process.h"
#include "tests/calibrator/simulated_robot.h"

namespace foresight::fuzz {
namespace {

constexpr const char* kArm = FORESIGHT_SOURCE_DIR "/deploy/arms/wam4.yaml";
constexpr double kMaxBase_m = 0.01;          // of the still base from its place
constexpr double kMaxScaleError = 0.02;      // relative, from the twin's
constexpr size_t kPointsPerObservation = 3;  // every so many points of those in view

// In the place of slam and of the arm's controller: publishes what the simulated robot would.
class RobotStandIn : public Process, public RobotListener {
 public:
  explicit RobotStandIn(Node& node)
      : node_(node),
        cameras_(node.advertise<camera_info_t>({.channel = "CAMERA_INFO"})),
        poses_(node.advertise<camera_pose_t>({.channel = "CAMERA_POSE"})),
        joints_(node.advertise<joint_state_t>({.channel = "JOINT_STATE"})),
        deltas_(node.advertise<map_delta_t>({.channel = "MAP_DELTA"}), node.now()),
        responder_(node, "MAP_DELTA", "asks for the whole map",
                   [this] { deltas_.send_snapshot(node_.now(), map_); }) {}

  void set_camera(const CameraModel& camera) { camera_ = camera; }

  void on_joints(Time time, const JointVector& position_rad) override {
    joint_state_t m{};
    m.utime = time.us;
    m.n_joints = static_cast<int32_t>(position_rad.size());
    m.position_rad.assign(position_rad.begin(), position_rad.end());
    m.reference_position_rad = m.target_position_rad = m.position_rad;
    m.velocity_rad_per_s.resize(m.position_rad.size());
    m.reference_velocity_rad_per_s = m.velocity_rad_per_s;
    joints_.publish(m);
  }
  void on_frame(const calibration::CameraFrame& frame) override {
    camera_pose_t m{};
    m.utime = frame.time.us;
    m.epoch = frame.epoch;
    m.state = camera_pose_t::STATE_TRACKING;
    write_pose(*frame.map_from_cam, &m);
    m.quality = static_cast<float>(frame.quality);
    m.points_found = frame.points_found;
    poses_.publish(m);
  }
  void on_map(int64_t epoch, bool, const MapDelta& keyframe) override {
    MapDelta delta = keyframe;
    map_.points_set.insert(map_.points_set.end(), delta.points_set.begin(), delta.points_set.end());
    for (const MapKeyframe& k : delta.keyframes_set) observe(k, &delta);
    map_.keyframes_set.insert(map_.keyframes_set.end(), delta.keyframes_set.begin(),
                              delta.keyframes_set.end());
    map_.observations_added.insert(map_.observations_added.end(), delta.observations_added.begin(),
                                   delta.observations_added.end());
    deltas_.send_delta(node_.now(), epoch, delta);
  }
  void on_second() override { cameras_.publish(to_message(camera_, node_.now())); }

 private:
  void observe(const MapKeyframe& keyframe, MapDelta* delta) const {
    for (size_t i = 0; i < map_.points_set.size(); i += kPointsPerObservation) {
      const MapPoint& p = map_.points_set[i];
      const Eigen::Vector3d in_cam =
          keyframe.map_from_cam.inverse() * p.position_in_map.cast<double>();
      if (in_cam.z() <= 0.01) continue;
      const Eigen::Vector2d px = camera_.project_normalized(in_cam.head<2>() / in_cam.z());
      if (px.x() < 0 || px.y() < 0 || px.x() > camera_.width_px || px.y() > camera_.height_px) {
        continue;
      }
      delta->observations_added.push_back({keyframe.id, p.id});
    }
  }

  Node& node_;
  CameraModel camera_;
  MapDelta map_;  // all of it
  Publisher<camera_info_t> cameras_;
  Publisher<camera_pose_t> poses_;
  Publisher<joint_state_t> joints_;
  DeltaSender<map_delta_t> deltas_;
  SnapshotResponder responder_;
};

// Lets the world catch up with the robot before each event.
class InStep : public RobotListener {
 public:
  InStep(Simulation* world, const SimulatedRobot* robot, RobotListener* next)
      : world_(world), robot_(robot), next_(next) {}
  void on_joints(Time time, const JointVector& position_rad) override {
    world_->run_until(robot_->now());
    next_->on_joints(time, position_rad);
  }
  void on_frame(const calibration::CameraFrame& frame) override { next_->on_frame(frame); }
  void on_map(int64_t epoch, bool is_first, const MapDelta& delta) override {
    next_->on_map(epoch, is_first, delta);
  }
  void on_second() override { next_->on_second(); }

 private:
  Simulation* world_;
  const SimulatedRobot* robot_;
  RobotListener* next_;
};

}  // namespace

class RobotLine::Line {
 public:
  Line() : robot_(load_arm_file(kArm), {}), world_(robot_.now()) {
    world_.add("carver", {Domain::kRobot},
               [](Node& n) { return std::make_unique<CarverProcess>(n, CarverParams{}); });
    world_.add("mesher", {Domain::kRobot},
               [](Node& n) { return std::make_unique<MesherProcess>(n, MesherParams{}); });
    CalibratorParams params;
    params.arm_file = kArm;
    world_.add("calibrator", {Domain::kRobot},
               [&](Node& n) { return std::make_unique<CalibratorProcess>(n, params); });
    stand_in_ = &static_cast<RobotStandIn&>(
        world_.add("robot", {}, [](Node& n) { return std::make_unique<RobotStandIn>(n); }));
    stand_in_->set_camera(robot_.camera());
  }

  Simulation& world() { return world_; }
  void run_for(double seconds_long) {
    InStep listener(&world_, &robot_, stand_in_);
    robot_.run(seconds_long, &listener);
    world_.run_until(robot_.now());
  }
  void on_message(const std::string& channel, std::span<const uint8_t> bytes) {
    if (channel == "ALIGNMENT") alignment = decode<alignment_t>(bytes);
    if (channel == "BASE_POSE") base = decode<base_pose_t>(bytes);
    if (channel == "MESH") mesh = decode<mesh_t>(bytes);
  }
  void forget() { base = {}; }
  Time now() const { return robot_.now(); }

  alignment_t alignment{};
  base_pose_t base{};
  mesh_t mesh{};

 private:
  SimulatedRobot robot_;
  Simulation world_;
  RobotStandIn* stand_in_ = nullptr;
};

RobotLine::RobotLine() : attacked_(std::make_unique<Line>()), twin_(std::make_unique<Line>()) {
  twin_->world().set_tap([this](Time, Domain, const std::string& channel, auto bytes) {
    twin_->on_message(channel, bytes);
  });
}
RobotLine::~RobotLine() = default;

Simulation& RobotLine::world() { return attacked_->world(); }

void RobotLine::run_for(double seconds_long) {
  attacked_->run_for(seconds_long);
  twin_->run_for(seconds_long);
}

void RobotLine::on_message(Domain, const std::string& channel, std::span<const uint8_t> bytes) {
  attacked_->on_message(channel, bytes);
}

void RobotLine::begin_judging() {
  attacked_->forget();
  twin_->forget();
}

std::string RobotLine::find_fault() {
  const Line &is = *attacked_, &should = *twin_;
  if (should.alignment.state != alignment_t::STATE_ALIGNED || should.mesh.n_triangles < 100) {
    return "the twin itself is not aligned or has no surface";
  }
  if (is.alignment.state != alignment_t::STATE_ALIGNED)
    return "not aligned: " + is.alignment.reason;
  if (is.alignment.epoch != should.alignment.epoch) return "aligned to another map";
  const double scale =
      is.alignment.world_from_map_scale_m_per_mu / should.alignment.world_from_map_scale_m_per_mu;
  if (!(std::abs(scale - 1) < kMaxScaleError))
    return "the scale is off by " + std::to_string(scale);
  const double base_m = Eigen::Vector3d(is.base.world_from_base_position_m).norm();
  if (is.base.state != base_pose_t::STATE_MEASURED || !(base_m < kMaxBase_m)) {
    return "the base is in state " + std::to_string(is.base.state) + ", " +
           std::to_string(1e3 * base_m) + " mm from its place";
  }
  if (is.mesh.epoch != should.mesh.epoch) return "the mesh is of another map";
  if (is.mesh.n_triangles != should.mesh.n_triangles) {
    return "the mesh has " + std::to_string(is.mesh.n_triangles) + " triangles instead of " +
           std::to_string(should.mesh.n_triangles);
  }
  return {};
}

}  // namespace foresight::fuzz
