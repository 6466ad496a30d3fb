#include "procs/wam_controller/process.h"

#include <sys/mman.h>

#include <algorithm>
#include <utility>

#include "common/realtime.h"
#include "common/robot_messages.h"
#include "procs/wam_controller/controller_options.h"

namespace foresight {
namespace {

constexpr int kRealtimePriority = 20;  // above the link
constexpr Duration kPeriod = milliseconds(2);

}  // namespace

WamControllerProcess::WamControllerProcess(Node& node, const WamControllerParams& params)
    : node_(node),
      params_(params),
      joint_states_(node.advertise<joint_state_t>({.channel = "JOINT_STATE",
                                                   .rate_hz = params.joint_state_rate_hz,
                                                   .doc = "joints, measured and reference"})),
      states_(node.advertise<controller_state_t>(
          {.channel = "CONTROLLER_STATE", .rate_hz = 10, .doc = "what it does, and why"})),
      jitter_(kPeriod) {
  node.subscribe<joint_command_t>(
      {.channel = "JOINT_COMMAND", .rate_hz = 30, .doc = "where the operator wants the joints"},
      Queue::kAll, [this](const joint_command_t& m) { on_command(m); });
  if (params.hardware == Hardware::kSim) {
    messages_ = std::make_unique<EncoderSource>(node, [this] { step(); });
  } else {
    node.every(kPeriod, "control", [this] { step(); });
    node.every(seconds(1), "keep home", [this] { keep_home(); });
  }
  node.every(milliseconds(100), "state", [this] { on_timer(); });
}

void WamControllerProcess::start() {
  const ArmModel arm = load_arm_file(params_.arm_file);
  check_margin(arm, params_);
  controller_.emplace(arm, options_of(params_));
  if (messages_) {
    messages_->start(arm, seconds(params_.encoder_timeout_s));
    hardware_ = messages_.get();
  } else {
    can_.emplace(start_can_arm(params_, arm, node_.now()));
    hardware_ = can_->arm.get();
  }
  start_realtime();
  report_health();
}

void WamControllerProcess::start_realtime() {
  if (node_.is_simulated()) return;
  has_realtime_ = params_.realtime && schedule_in_real_time(kRealtimePriority) &&
                  mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  node_.set_metric("realtime", has_realtime_ ? 1 : 0);
}

void WamControllerProcess::on_command(const joint_command_t& message) {
  const JointCommand command = read_command(message);
  look_at_clock();
  watch_.on_command(node_.now(), command, controller_->on_command(node_.now(), command));
  report_change();
}

// Where the arm was last seen, for the next start. A file takes its time: not in this thread.
void WamControllerProcess::keep_home() {
  const auto counts = can_->arm->position_counts();
  can_->home.counts_last_seen.assign(counts.begin(), counts.end());
  const auto job = [this, path = params_.can_home_file, home = can_->home] {
    const bool is_kept = keep_home_reference(path, home);
    return [this, is_kept] { node_.set_metric("can_home_kept", is_kept ? 1 : 0); };
  };
  if (!node_.run_beside(job, milliseconds(1))) node_.set_metric("can_home_kept", 0);
}

// One control step: at each ARM_ENCODERS message, or by timer on the CAN bus.
void WamControllerProcess::step() {
  ArmReading reading;
  if (!hardware_->read(node_.now(), &reading)) return;
  hardware_->write(controller_->step(reading));
  if (!node_.is_simulated()) jitter_.tick(node_.now());
  if (!reading.fault.empty()) board_fault_ = reading.fault;
  is_warning_ = reading.is_warning;
  largest_error_rad_ = std::max(largest_error_rad_, controller_->tracking_error_rad());
  report_change();
  const Duration period = seconds(1 / params_.joint_state_rate_hz);
  const Duration late = reading.time - joint_state_due_;
  if (late < period * -1 || late > period) joint_state_due_ = reading.time;  // or the clock jumped
  if (reading.time < joint_state_due_) return;
  publish_joints();
  joint_state_due_ = joint_state_due_ + period;
}

void WamControllerProcess::look_at_clock() {
  const int64_t changes = node_.clock_changes();
  if (changes != std::exchange(clock_changes_, changes)) watch_.on_clock_change(node_.now());
}

void WamControllerProcess::on_timer() {
  look_at_clock();
  controller_->on_time(node_.now());
  watch_.on_time(node_.now(), malformed_commands());
  publish_state();
  report_health();
  set_metrics();
}

// Datagrams that are no command at all (NaN, say) never get as far as the controller.
int64_t WamControllerProcess::malformed_commands() const {
  for (const PortRecord& port : node_.ports()) {
    if (port.is_input && port.spec.channel == "JOINT_COMMAND") return port.rejected;
  }
  return 0;
}

WamControllerProcess::Reported WamControllerProcess::present() const {
  const CommandGate& gate = controller_->gate();
  return {controller_->status(), gate.driver_session(), gate.needs_release()};
}

void WamControllerProcess::report_change() {
  if (present() == reported_) return;
  publish_state();
  report_health();
}

std::string WamControllerProcess::reason() const {
  const ArmStatus& status = controller_->status();
  std::string text = to_string(status.reason);
  if (status.joint >= 0) text = "joint " + std::to_string(status.joint + 1) + ": " + text;
  if (status.reason == ArmReason::kSafetyFault) text += ": " + board_fault_;
  return text;
}

void WamControllerProcess::publish_state() {
  reported_ = present();
  const CommandGate& gate = controller_->gate();
  controller_state_t m{};
  write_controller_state({.time = node_.now(),
                          .state = reported_.status.state,
                          .reason = reason(),
                          .driver_session = reported_.driver_session,
                          .needs_release = reported_.needs_release,
                          .commands_of_others = gate.count(CommandVerdict::kOfOthers),
                          .limits = controller_->limits()},
                         &m);
  m.commands_accepted = gate.count(CommandVerdict::kAccepted);
  m.commands_out_of_order = gate.count(CommandVerdict::kOutOfOrder);
  m.commands_stale = gate.count(CommandVerdict::kStale);
  m.commands_refused = gate.count(CommandVerdict::kMisshapen) + gate.count(CommandVerdict::kAhead);
  m.commands_limited = controller_->commands_limited();
  m.period_jitter_p99_ms = static_cast<float>(jitter_.p99_ms(node_.now()));
  states_.publish(m);
}

void WamControllerProcess::publish_joints() {
  joint_states_.publish(write_joint_state(controller_->snapshot()));
}

// What is said of commands concerns an arm that could move.
void WamControllerProcess::report_health() {
  const ArmState state = controller_->status().state;
  if (state == ArmState::kIdle) return node_.set_state(ProcessState::kWaiting, reason());
  const bool is_wrong =
      state == ArmState::kFault || controller_->status().reason == ArmReason::kWeight;
  if (is_wrong) return node_.set_state(ProcessState::kDegraded, reason());
  if (!watch_.complaint().empty()) {
    return node_.set_state(ProcessState::kDegraded, watch_.complaint());
  }
  node_.set_state(ProcessState::kOk,
                  has_realtime_ ? "" : "without real-time scheduling: late steps under load");
}

void WamControllerProcess::set_metrics() {
  node_.set_metric("command_age_ms", watch_.age_ms());
  node_.set_metric("operator_clock_ahead_ms", watch_.clock_ahead_ms());
  node_.set_metric("commands_needing_release",
                   static_cast<double>(controller_->gate().count(CommandVerdict::kNeedsRelease)));
  node_.set_metric("tracking_error_max_rad", largest_error_rad_);
  node_.set_metric("weight_error_nm", controller_->weight_error_nm());
  node_.set_metric("safety_warning", is_warning_ ? 1 : 0);
  largest_error_rad_ = 0;
  if (!can_) return;
  const CanArmCounts& counts = can_->arm->counts();
  node_.set_metric("can_send_errors", static_cast<double>(counts.send_errors));
  node_.set_metric("can_incomplete_reads", static_cast<double>(counts.incomplete_reads));
  node_.set_metric("can_unknown_frames", static_cast<double>(counts.unknown_frames));
}

}  // namespace foresight
