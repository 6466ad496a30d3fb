#include "procs/omni/process.h"

#include <algorithm>
#include <iostream>

#include "common/robot_messages.h"

namespace foresight {
namespace {

constexpr size_t kLongestReason = 200;
// Without a command for so long the arm's controller takes the operator for gone, usually.
constexpr Duration kLongestPause = seconds(0.5);

}  // namespace

OmniProcess::OmniProcess(Node& node, const OmniParams& params, DeviceMaker make)
    : node_(node),
      params_(params),
      make_(std::move(make)),
      states_(node.advertise<device_state_t>({.channel = "DEVICE_STATE",
                                              .domain = Domain::kOperator,
                                              .rate_hz = params.rate_hz,
                                              .doc = "the operator's device as it was read"})),
      commands_(node.advertise<joint_command_t>({.channel = "JOINT_COMMAND",
                                                 .domain = Domain::kOperator,
                                                 .rate_hz = params.rate_hz,
                                                 .doc = "where the arm's joints shall be"})),
      clutch_(params.clutch) {
  joint_state_input_ = node.subscribe<joint_state_t>(
      {.channel = "JOINT_STATE",
       .domain = Domain::kOperator,
       .doc = "where the arm is, so that engaging is no jump"},
      Queue::kLatest, [this](const joint_state_t& m) { on_joint_state(m); });
  node.subscribe<controller_state_t>(
      {.channel = "CONTROLLER_STATE",
       .domain = Domain::kOperator,
       .doc = "whether the arm follows, and whom"},
      Queue::kAll, [this](const controller_state_t& m) { on_controller_state(m); });
  node.subscribe<joint_command_t>({.channel = "JOINT_COMMAND",
                                   .domain = Domain::kOperator,
                                   .doc = "whether somebody else commands at this site",
                                   .optional = true},
                                  Queue::kAll, [this](const joint_command_t& m) {
                                    rivals_.on_command(steady_.at(node_.now()), m.session,
                                                       session_.session());
                                  });
  node.every(seconds(1 / params.rate_hz), "read device", [this] { on_tick(); });
}

void OmniProcess::start() {
  const ArmModel arm = load_arm_file(params_.arm_file);
  for (const ArmJoint& joint : arm.joints) {
    if (joint.upper_rad - joint.lower_rad > 2 * params_.commander.limit_margin_rad) continue;
    throw ConfigError("limit_margin_rad: leaves a joint of " + params_.arm_file + " no room");
  }
  const JointMapping mapping = choose_mapping(params_, arm);
  device_ = make_(params_, arm, mapping);
  device_->open();
  commander_.emplace(arm, mapping, params_.commander);
  robot_.emplace(RobotWatchOptions{.silence = seconds(params_.robot_silence_s),
                                   .longest_round_trip = seconds(params_.longest_round_trip_s)},
                 arm.size());
  session_.begin(node_.now());
  robot_->begin_session(session_.session());
}

void OmniProcess::on_joint_state(const joint_state_t& message) {
  const Time now = node_.now(), arrival = steady_.at(now);
  const auto state = read_joint_state(message);
  if (!state || !commander_->set_measured(arrival, state->position_rad)) {
    joint_state_input_.reject("its joints are not those of " + params_.arm_file);
    robot_->on_other_arm(arrival, message.n_joints);
    return;
  }
  clocks_.add({now, state->time, state->command_time, state->command_arrival});
  const auto round_trip = clocks_.round_trip();
  if (round_trip) commander_->set_round_trip(*round_trip);
  robot_->on_joints(arrival, state->time, state->command_time, round_trip);
}

void OmniProcess::on_controller_state(const controller_state_t& message) {
  const Time arrival = steady_.at(node_.now());
  ControllerState state = read_controller_state(message);
  state.reason.resize(std::min(state.reason.size(), kLongestReason));
  commander_->set_velocity_limit(state.limits.motion.velocity);
  robot_->on_report(arrival, state);
  rivals_.on_dropped(arrival, state.commands_of_others);
}

void OmniProcess::on_tick() {
  const Time now = node_.now(), steady = steady_.at(now);
  const std::string obstacle = find_obstacle(now, steady);
  device_->allow_engaging(obstacle.empty());
  const DeviceReading reading = device_->read(steady);
  const bool was_engaged = commander_->is_engaged();
  const bool engage = heed_clutch(reading, obstacle);
  if (!obstacle.empty()) commander_->stand_down();
  commander_->update(steady, reading, engage);
  if (commander_->is_engaged() && !was_engaged) ++engagements_;
  publish_device(now, reading);
  publish_command(now, steady);
  set_metrics();
  report(reading, obstacle);
}

std::string OmniProcess::find_obstacle(Time now, Time steady) {
  const Duration longest = std::max(kLongestPause, seconds(3 / params_.rate_hz));
  const bool has_paused = last_tick_ && steady - *last_tick_ > longest;
  last_tick_ = steady;
  if (session_.update(now)) {
    robot_->begin_session(session_.session());
    return "the clock was set back";
  }
  if (has_paused) return "omni stood still, or the clock was set forward";
  return robot_->obstacle(steady);
}

bool OmniProcess::heed_clutch(const DeviceReading& reading, const std::string& obstacle) {
  const bool is_usable = reading.connected && !reading.silent && obstacle.empty();
  const bool is_on = clutch_.update(is_usable, reading.engaged);
  if (!is_usable) let_go_because_ = obstacle.empty() ? reading.problem : obstacle;
  return is_on && !reading.quit && !reading.ended;
}

void OmniProcess::publish_device(Time now, const DeviceReading& reading) {
  device_state_t state{};
  state.utime = now.us;
  state.device = name_of(params_.device);
  state.connected = reading.connected ? 1 : 0;
  state.engaged = reading.engaged ? 1 : 0;
  // Deflections are no joint positions.
  const bool has_joints = reading.kind == AxisKind::kPosition;
  (has_joints ? state.position_rad : state.deflections) = reading.axes;
  state.n_joints = static_cast<int32_t>(state.position_rad.size());
  state.n_deflections = static_cast<int32_t>(state.deflections.size());
  state.buttons.assign(reading.buttons.begin(), reading.buttons.end());
  state.n_buttons = static_cast<int32_t>(state.buttons.size());
  states_.publish(state);
}

void OmniProcess::publish_command(Time now, Time steady) {
  commands_.publish(write_command({.time = now,
                                   .session = session_.session(),
                                   .seq = session_.next_seq(),
                                   .is_engaged = commander_->is_engaged(),
                                   .position_rad = commander_->position_rad()}));
  robot_->on_command(steady, now, commander_->is_engaged());
}

void OmniProcess::set_metrics() {
  const auto ms = [](Duration d) { return 1e3 * d.seconds(); };
  node_.set_metric("engaged", commander_->is_engaged() ? 1 : 0);
  node_.set_metric("followed", robot_->is_followed() ? 1 : 0);
  node_.set_metric("engagements", engagements_);
  node_.set_metric("at_joint_limit", commander_->is_limited() ? 1 : 0);
  if (clocks_.downlink()) node_.set_metric("robot_clock_ahead_ms", ms(clocks_.offset()));
  if (clocks_.round_trip()) node_.set_metric("round_trip_ms", ms(*clocks_.round_trip()));
}

void OmniProcess::report(const DeviceReading& reading, const std::string& obstacle) {
  if (reading.quit) return node_.finish("the operator typed q", kExitDone);
  if (node_.state() == ProcessState::kDone) return;
  if (reading.ended) {
    return node_.finish("end of " + params_.device_path,
                        params_.exit_at_end ? std::optional(kExitDone) : std::nullopt);
  }
  if (!reading.connected) return node_.set_state(ProcessState::kWaiting, reading.problem);
  const std::string description = device_->description();
  if (description != description_) std::cerr << "omni: " << description << "\n";
  description_ = description;
  const std::string trouble = find_trouble(reading, obstacle);
  if (!trouble.empty()) return node_.set_state(ProcessState::kDegraded, trouble);
  node_.set_state(ProcessState::kOk, description);
}

// The first of what keeps the hand from moving the arm, or makes it move otherwise than it thinks.
std::string OmniProcess::find_trouble(const DeviceReading& reading,
                                      const std::string& obstacle) const {
  if (!obstacle.empty()) return obstacle;
  if (!reading.silent && reading.engaged && clutch_.needs_release()) {
    return "let go of the clutch and press it again (" + let_go_because_ + ")";
  }
  for (const std::string& trouble :
       {commander_->problem(), reading.problem, robot_->complaint(), clocks_.complaint(),
        rivals_.complaint(*last_tick_), commander_->slowness()}) {
    if (!trouble.empty()) return trouble;
  }
  return {};
}

}  // namespace foresight
