#include "sim/robot/process.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/robot_messages.h"
#include "sim/sequence.h"

namespace foresight::sim {
namespace {

constexpr int64_t kMaxTicksAtOnce = 10;           // to catch up with the host's clock
constexpr int64_t kTooManyRefused = 3;            // torques in a second
constexpr Duration kLookEvery = milliseconds(1);  // for whether the own clock may go on

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

RobotParams robot_params(const SimParams& p) {
  RobotParams robot;
  robot.plant.coulomb_share *= p.friction;
  robot.plant.viscous_share_s *= p.friction;
  robot.base = {.kind = p.base_motion,
                .start_s = p.base_start_s,
                .duration_s = p.base_duration_s,
                .amplitude_m = p.base_amplitude_m,
                .amplitude_rad = radians(p.base_amplitude_deg),
                .direction_rad = radians(p.base_direction_deg),
                .speed_m_per_s = p.base_speed_m_per_s,
                .period_s = p.base_period_s,
                .seed = static_cast<uint64_t>(p.seed)};
  robot.start_mode = p.start_active ? SafetyMode::kActive : SafetyMode::kIdle;
  robot.heartbeat = seconds(p.heartbeat_s);
  return robot;
}

CameraRigParams rig_params(const SimParams& p) {
  CameraRigParams rig;
  rig.camera = {.model = sequence_camera(p.camera_width_px, p.camera_distorted),
                .exposure = p.camera_exposure,
                .noise_levels = p.camera_noise_levels,
                .antialiasing = p.camera_antialiasing};
  rig.jpeg_quality = p.jpeg_quality;
  return rig;
}

}  // namespace

SimProcess::SimProcess(Node& node, const SimParams& params)
    : node_(node),
      params_(params),
      has_own_clock_(params.clock == WorldClock::kOwn),
      encoders_(node.advertise<arm_encoders_t>(
          {.channel = "ARM_ENCODERS", .rate_hz = 500, .doc = "motors and safety board"})),
      truths_(node.advertise<truth_t>({.channel = "TRUTH_STATE",
                                       .rate_hz = params.truth_rate_hz,
                                       .doc = "what is really so, for evaluation alone"})),
      pacer_(params.speed, kTick) {
  torque_input_ = node.subscribe<arm_torques_t>(
      {.channel = "ARM_TORQUES", .rate_hz = 500, .doc = "the controller's answer to encoders"},
      Queue::kAll, [this](const arm_torques_t& m) { on_torques(m); });
  node.subscribe<pendant_t>({.channel = "PENDANT", .doc = "a person presses a button"}, Queue::kAll,
                            [this](const pendant_t& m) { robot_->press(m.button); });
  if (params.camera_rate_hz > 0) photographer_ = std::make_unique<Photographer>(node, params);
  if (has_own_clock_) {
    for (const Domain domain : {Domain::kRobot, Domain::kOperator}) {
      clocks_.push_back(node.advertise<sim_clock_t>(
          {.channel = "CLOCK", .domain = domain, .rate_hz = 500, .doc = "time in this world"}));
    }
    node.every(kLookEvery, "own clock", [this] { run_at_own_pace(); });
  } else {
    node.every(kTick, "arm", [this] { follow_host_clock(); });
  }
  node.every(seconds(1), "report", [this] { report(); });
}

void SimProcess::start() {
  const ArmModel arm = load_arm_file(params_.arm_file);
  std::shared_ptr<CameraRig> rig;
  if (photographer_) {
    rig = std::make_shared<CameraRig>(open_scene(params_), rig_params(params_));
  }
  robot_ = std::make_unique<Robot>(arm, robot_params(params_), node_.now());
  if (photographer_) {
    photographer_->start(std::move(rig), robot_->now(), [this] {
      if (has_own_clock_) run_at_own_pace();
    });
  }
  const double ticks_per_s = 1 / kTick.seconds();
  if (params_.truth_rate_hz > 0) {
    truth_every_ = std::max<int64_t>(1, std::llround(ticks_per_s / params_.truth_rate_hz));
  }
  reported_at_ = robot_then_ = robot_->now();
  report_state();
}

void SimProcess::follow_host_clock() {
  const Time begin = node_.now();
  const int64_t behind = (begin - robot_->now()).us / kTick.us;
  for (int64_t i = 0; i < std::min(behind, kMaxTicksAtOnce); ++i) tick();
  if (behind > kMaxTicksAtOnce) {
    robot_->pass_over(kTick * (behind - kMaxTicksAtOnce));
    lost_ticks_ += behind - kMaxTicksAtOnce;
  }
  tick_time_ = tick_time_ + (node_.now() - begin);
}

void SimProcess::run_at_own_pace() {
  const auto frame_is_late = [&] {
    return photographer_ && photographer_->is_late_for(robot_->now() + kTick);
  };
  while (pacer_.may_tick(node_.now(), frame_is_late())) {
    const Time begin = node_.now();
    pacer_.on_tick(begin);
    tick();
    tick_time_ = tick_time_ + (node_.now() - begin);
  }
}

void SimProcess::tick() {
  robot_->tick();
  const Time now = robot_->now();
  for (const auto& clock : clocks_) {
    sim_clock_t message{};
    message.utime = now.us;
    clock.publish(message);
  }
  publish_encoders();
  if (truth_every_ > 0 && ticks_ % truth_every_ == 0) {
    truths_.publish(to_message(robot_->truth_at(now), now));
  }
  if (photographer_) photographer_->on_tick(*robot_);
  ++ticks_;
}

void SimProcess::publish_encoders() {
  arm_encoders_t message{};
  message.utime = robot_->now().us;
  message.n_motors = robot_->joint_count();
  message.motor_counts.resize(static_cast<size_t>(message.n_motors));
  robot_->read_encoders(message.motor_counts);
  message.safety = static_cast<int8_t>(robot_->board().mode());
  message.is_warning = robot_->board().is_warning() ? 1 : 0;
  message.fault = robot_->board().fault();
  encoders_.publish(message);
}

void SimProcess::on_torques(const arm_torques_t& message) {
  if (message.n_motors != robot_->joint_count()) {
    return torque_input_.reject("has another number of motors than the arm");
  }
  if (!robot_->take_torques({message.utime},
                            JointVector::Map(message.motor_torque_nm.data(), message.n_motors))) {
    ++refused_torques_;
    return torque_input_.reject("answers no reading of this arm, or one that is answered already");
  }
  pacer_.on_torques(message.utime == robot_->now().us);
  if (has_own_clock_) run_at_own_pace();
}

void SimProcess::report() {
  const double wall_s = (node_.now() - reported_at_).seconds();
  if (wall_s <= 0) return;
  const double factor = (robot_->now() - robot_then_).seconds() / wall_s;
  node_.set_metric("refused_torques", static_cast<double>(refused_torques_));
  node_.set_metric("time_s", static_cast<double>(ticks_) * kTick.seconds());
  node_.set_metric("real_time_factor", std::round(1e3 * factor) / 1e3);
  if (has_own_clock_) {
    node_.set_metric("unanswered_ticks", static_cast<double>(pacer_.unanswered()));
  } else {
    node_.set_metric("lost_ticks", static_cast<double>(lost_ticks_));
  }
  if (photographer_) {
    node_.set_metric("frames", static_cast<double>(photographer_->published()));
    node_.set_metric("skipped_frames", static_cast<double>(photographer_->skipped()));
    if (!node_.is_simulated()) node_.set_metric("render_ms", photographer_->take_render_ms());
  }
  const int64_t ticks = ticks_ - ticks_then_;
  if (ticks > 0 && !node_.is_simulated()) {
    node_.set_metric("tick_us", static_cast<double>(tick_time_.us) / static_cast<double>(ticks));
  }
  report_state();
  tick_time_ = {0};
  ticks_then_ = ticks_;
  lost_then_ = lost_ticks_;
  refused_then_ = refused_torques_;
  skipped_then_ = photographer_ ? photographer_->skipped() : 0;
  reported_at_ = node_.now();
  robot_then_ = robot_->now();
}

void SimProcess::report_state() {
  const SafetyBoard& board = robot_->board();
  const int64_t skipped = photographer_ ? photographer_->skipped() - skipped_then_ : 0;
  if (board.mode() != SafetyMode::kActive) {
    const std::string mode = board.mode() == SafetyMode::kIdle ? "the arm is IDLE" : "E-STOP";
    const std::string why = board.fault().empty() ? ": press the pendant" : ": " + board.fault();
    node_.set_state(ProcessState::kDegraded, mode + why);
  } else if (!board.is_driven()) {
    node_.set_state(ProcessState::kWaiting, "no torques from the controller yet");
  } else if (const int64_t refused = refused_torques_ - refused_then_; refused >= kTooManyRefused) {
    node_.set_state(ProcessState::kDegraded,
                    "somebody else sends torques, too: " + std::to_string(refused) + " refused");
  } else if (lost_ticks_ > lost_then_) {
    node_.set_state(ProcessState::kDegraded, "this machine cannot keep up: time was lost");
  } else if (skipped > 0) {
    node_.set_state(ProcessState::kDegraded, "rendering cannot keep up: frames were skipped");
  } else {
    node_.set_state(ProcessState::kOk, "");
  }
}

}  // namespace foresight::sim
