#include "procs/omni/process.h"

#include <algorithm>

namespace foresight {

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
      clutch_(params.clutch == "toggle" ? ClutchMode::kToggle : ClutchMode::kHold) {
  node.subscribe<joint_state_t>({.channel = "JOINT_STATE",
                                 .domain = Domain::kOperator,
                                 .doc = "where the arm is, so that engaging is no jump"},
                                Queue::kLatest,
                                [this](const joint_state_t& m) { on_joint_state(m); });
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
  CommanderOptions options = params_.commander;
  options.mode = params_.mode == "relative" ? MotionMode::kRelative : MotionMode::kAbsolute;
  commander_.emplace(arm, mapping, options);
  session_ = node_.now().us;
}

void OmniProcess::on_joint_state(const joint_state_t& state) {
  const JointVector::Index count =
      std::min<JointVector::Index>(state.n_joints, JointVector::MaxRowsAtCompileTime);
  const JointVector position_rad = JointVector::Map(state.position_rad.data(), count);
  if (state.n_joints != count || !commander_->set_measured(node_.now(), position_rad)) {
    node_.reject_message("JOINT_STATE", "its joints are not those of " + params_.arm_file);
  }
}

void OmniProcess::on_tick() {
  const Time now = node_.now();
  const DeviceReading reading = device_->read(now);
  const bool was_engaged = commander_->is_engaged();
  const bool engage =
      clutch_.update(reading.connected, reading.engaged) && !reading.quit && !reading.ended;
  commander_->update(now, reading, engage);
  if (commander_->is_engaged() && !was_engaged) ++engagements_;
  publish_device(now, reading);
  publish_command(now);
  report(reading);
}

void OmniProcess::publish_device(Time now, const DeviceReading& reading) {
  device_state_t state{};
  state.utime = now.us;
  state.device = params_.device;
  state.connected = reading.connected ? 1 : 0;
  state.engaged = reading.engaged ? 1 : 0;
  // Deflections are no joint positions.
  if (reading.kind == AxisKind::kPosition) state.position_rad = reading.axes;
  state.n_joints = static_cast<int32_t>(state.position_rad.size());
  state.buttons.assign(reading.buttons.begin(), reading.buttons.end());
  state.n_buttons = static_cast<int32_t>(state.buttons.size());
  states_.publish(state);
}

void OmniProcess::publish_command(Time now) {
  joint_command_t command{};
  command.utime = now.us;
  command.session = session_;
  command.seq = ++seq_;
  command.engaged = commander_->is_engaged() ? 1 : 0;
  const JointVector& position_rad = commander_->position_rad();
  command.n_joints = static_cast<int32_t>(position_rad.size());
  command.position_rad.assign(position_rad.data(), position_rad.data() + position_rad.size());
  commands_.publish(command);
}

void OmniProcess::report(const DeviceReading& reading) {
  node_.set_metric("engaged", commander_->is_engaged() ? 1 : 0);
  node_.set_metric("engagements", engagements_);
  node_.set_metric("at_joint_limit", commander_->is_limited() ? 1 : 0);
  if (reading.quit) return node_.finish("the operator typed q", true);
  if (node_.state() == ProcessState::kDone) return;
  if (reading.ended) return node_.finish("end of " + params_.device_path, params_.exit_at_end);
  const std::string& problem = commander_->problem();
  if (!reading.connected) {
    node_.set_state(ProcessState::kWaiting, reading.problem);
  } else if (!problem.empty() || !reading.problem.empty()) {
    node_.set_state(ProcessState::kDegraded, problem.empty() ? reading.problem : problem);
  } else {
    node_.set_state(ProcessState::kOk, "");
  }
}

}  // namespace foresight
