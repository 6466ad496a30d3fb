#include "tests/renderer/display_rig.h"

#include "common/image_codec.h"
#include "common/message_bytes.h"
#include "common/messages.h"

namespace foresight {
namespace {}  // namespace

DisplayRig::DisplayRig()
    : camera_(pinhole_camera().scaled(0.5)),
      map_from_cam_(scene_.pose(0, 0, 0)),
      arm_(load_arm_file(FORESIGHT_DEPLOY "/arms/wam4.yaml")) {
  params.display = Display::kHeadless;
  params.layout = Layout::kPredicted;
  params.predict = Predict::kRobot;
  params.arm_file = FORESIGHT_DEPLOY "/arms/wam4.yaml";
  params.picture_width_px = 160;
  params.used_views = 2;
  params.stored_views = 4;
  camera_.prepare();
  picture_ = scene_.image(camera_, map_from_cam_).bytes;
  mesh_ = to_message(scene_.mesh(4));
  mesh_.epoch = kDisplayEpoch;
  mesh_.version = 5;
  mesh_.utime = kDisplayStart.us - 500'000;
  controller.state = controller_state_t::STATE_FOLLOWING;
  controller.velocity_limit_rad_per_s = controller.acceleration_limit_rad_per_s2 = 1;
  controller.limit_margin_rad = 0.05;
  controller.command_timeout_s = 0.5;
}

void DisplayRig::start() {
  world_ = std::make_unique<Simulation>(kDisplayStart);
  world_->listen(Domain::kOperator, "HEALTH",
                 [this](auto bytes) { health_ = decode<health_t>(bytes); });
  world_->listen(Domain::kOperator, "DISPLAY_STATS", [this](auto bytes) {
    ++drawn_.pictures;
    if (decode<display_stats_t>(bytes).epoch != 0) ++drawn_.predictions;
  });
  // The mesher: the scene stands still, so that a mesh comes on request only.
  world_->listen(Domain::kOperator, "SNAPSHOT_REQUEST", [this](auto) {
    if (!stopped.contains("MESH")) send("MESH", mesh());
  });
  auto& renderer = static_cast<RendererProcess&>(
      world_->add("renderer", health_domains(RendererProcess::kInfo),
                  [this](Node& node) { return std::make_unique<RendererProcess>(node, params); }));
  renderer.set_listener([this](const PredictedFrame& frame) { frame_ = frame; });
}

void DisplayRig::run(double for_s) {
  const Time end = now() + seconds(for_s);
  while (now() < end) {
    tick(ticks_++);
    every_10_ms(now());
    world_->run_until(now() + milliseconds(10));
  }
}

template <class Message>
void DisplayRig::send(const char* channel, const Message& message) {
  if (stopped.contains(channel)) return;
  world_->inject(now() + delay, Domain::kOperator, channel, encode(message));
}

void DisplayRig::tick(int i) {
  send("JOINT_STATE", joint_state());
  if (i % 10 == 0) {
    controller.utime = robot_time().us;
    send("CONTROLLER_STATE", controller);
    send("VIEW", view());
    send("BASE_POSE", base());
    for (const int64_t session : senders) {
      if (!stopped.contains("JOINT_COMMAND")) inject("JOINT_COMMAND", command(session));
    }
  }
  if (i % 100 == 0) {
    send("CAMERA_INFO", camera_info());
    send("ALIGNMENT", alignment());
  }
}

camera_info_t DisplayRig::camera_info() const { return to_message(camera_, robot_time()); }

view_t DisplayRig::view() const {
  view_t view{};
  view.utime = view.pose.utime = view.image.utime = robot_time().us;
  view.pose.epoch = kDisplayEpoch;
  view.pose.state = camera_pose_t::STATE_TRACKING;
  write_pose(map_from_cam_, &view.pose);
  encode_raw({camera_.width_px, camera_.height_px, 3, picture_}, &view.image);
  return view;
}

mesh_t DisplayRig::mesh() const { return mesh_; }

joint_state_t DisplayRig::joint_state() const {
  joint_state_t state{};
  state.utime = robot_time().us;
  state.n_joints = joint_count;
  std::vector<double> home = write_joints(arm_.home());
  home.resize(static_cast<size_t>(joint_count));
  state.position_rad = state.reference_position_rad = state.target_position_rad = home;
  state.velocity_rad_per_s = state.reference_velocity_rad_per_s =
      std::vector<double>(home.size(), 0.0);
  // Commands come every 0.1 s.
  const Time given{(now() - delay).us / 100'000 * 100'000};
  state.command_utime = given.us;
  state.command_arrival_utime = (given + delay + robot_clock).us;
  return state;
}

base_pose_t DisplayRig::base() const {
  base_pose_t base{};
  base.utime = robot_time().us;
  base.epoch = kDisplayEpoch;
  base.state = base_pose_t::STATE_MEASURED;
  write_transform(Pose<World, Base>(), base.world_from_base_quat_wxyz,
                  base.world_from_base_position_m);
  return base;
}

alignment_t DisplayRig::alignment() const {
  alignment_t alignment{};
  alignment.utime = kDisplayStart.us;
  alignment.epoch = kDisplayEpoch;
  alignment.state = alignment_t::STATE_ALIGNED;
  alignment.world_from_map_scale_m_per_mu = 1;
  const Pose<Base, Ee> hand = arm_.base_from_ee(arm_.home());
  const Pose<World, Cam> camera(hand.rotation(), hand.translation());
  write_transform(camera * map_from_cam_.inverse(), alignment.world_from_map_quat_wxyz,
                  alignment.world_from_map_position_m);
  write_transform(Pose<Ee, Cam>(), alignment.ee_from_cam_quat_wxyz,
                  alignment.ee_from_cam_position_m);
  return alignment;
}

joint_command_t DisplayRig::command(int64_t session) const {
  joint_command_t command{};
  command.utime = now().us;
  command.session = session;
  command.seq = now().us;
  command.engaged = 1;
  command.position_rad = write_joints(arm_.home());
  command.n_joints = arm_.size();
  return command;
}

double DisplayRig::metric(const std::string& name) const {
  for (size_t i = 0; i < health_.metric_names.size(); ++i) {
    if (health_.metric_names[i] == name) return health_.metric_values[i];
  }
  ADD_FAILURE() << "no metric " << name;
  return 0;
}

const port_health_t& DisplayRig::port(const std::string& channel, Domain domain) const {
  for (const port_health_t& port : health_.ports) {
    const bool is_operator = port.is_operator_domain != 0;
    if (port.is_input != 0 && port.channel == channel &&
        is_operator == (domain == Domain::kOperator)) {
      return port;
    }
  }
  ADD_FAILURE() << "no port " << channel;
  return health_.ports.front();
}

}  // namespace foresight
