#include "procs/renderer/camera_predictor.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace foresight {
namespace {

constexpr Duration kAccelerationLasts = milliseconds(350);
constexpr size_t kDelaysKept = 31;
// Long enough to see an acceleration through the noise, short beside the motions of a base.
constexpr Duration kAccelerationWindow = milliseconds(250);
// Delays vary: what arrived so shortly before a message was sent may not be in it.
constexpr Duration kArrivalMargin = milliseconds(50);
constexpr Duration kLongestDelay = seconds(120);
// No arm and no base of ours goes there: rad, rad/s, m, m/s.
constexpr double kFarthest = 1e4;

bool is_near(const Eigen::Ref<const Eigen::VectorXd>& values) {
  return values.allFinite() && (values.array().abs() < kFarthest).all();
}

bool fits(const JointState& s, int size) {
  for (const JointVector* v :
       {&s.position_rad, &s.reference_rad, &s.reference_velocity_rad_per_s, &s.target_rad}) {
    if (v->size() != size || !is_near(*v)) return false;
  }
  if (s.command_time.us == 0) return true;
  if (!is_plausible(s.command_time) || !is_plausible(s.command_arrival)) return false;
  const Duration delay = s.command_arrival - s.command_time;
  return delay < kLongestDelay && delay > kLongestDelay * -1;
}

bool is_told(const ControllerLimits& limits) {
  const auto within = [](double value, double low, double high) {
    return value >= low && value <= high;
  };
  return within(limits.motion.velocity, 1e-3, 100) &&
         within(limits.motion.acceleration, 1e-3, 1e4) && within(limits.joint_margin_rad, 0, 3.2) &&
         within(limits.command_timeout.seconds(), 1e-3, 600);
}

// Else commands move nothing.
bool is_powered(const ControllerState& controller) {
  return controller.state != ArmState::kIdle && controller.state != ArmState::kFault;
}

std::string number_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

std::string milliseconds_text(Duration d) { return std::to_string(std::abs(d.us) / 1000) + " ms"; }

std::string age_text(Time now, int64_t session) {
  // A sender may name itself as it likes.
  if (!is_plausible({session})) return "at no possible time";
  return seconds_text(now - Time{session}, 0) + " ago";
}

}  // namespace

CameraPredictor::CameraPredictor(const ArmModel& arm, const CameraPredictorOptions& options)
    : arm_(arm), options_(options), commands_(arm.size()) {}

CommandIntake CameraPredictor::add_command(Time now, const JointCommand& command) {
  return commands_.add(now, command, known_driver());
}

bool CameraPredictor::set_joint_state(Time now, const JointState& state) {
  if (!fits(state, arm_.size())) return false;
  // Also of a state that is refused: its stamp may be the first sign of a clock that was set.
  if (is_plausible(state.time)) downlink_.add(now, now - state.time);
  if (!is_taken(state_order_.judge(now, state.time))) return false;
  const bool new_command =
      state.command_time.us != 0 && (!state_ || state.command_time != state_->command_time);
  if (new_command) {
    delays_.push_back(state.command_arrival - state.command_time);
    if (delays_.size() > kDelaysKept) delays_.pop_front();
  }
  state_ = state;
  state_watch_.arrive(now);
  watch_clocks(now);
  return true;
}

void CameraPredictor::watch_clocks(Time now) {
  const Duration stepped = clocks_.stepped();
  clocks_.add({now, state_->time, state_->command_time, state_->command_arrival});
  if (clocks_.stepped() != stepped) step_time_ = now;
}

// A small difference that stays is measured with every command, and reckoned with: what is stamped
// by the robot's clock is never compared with this site's but through command_delay().
std::string CameraPredictor::clock_doubt(Time now) const {
  if (const auto jump = downlink_.jump()) {
    return "the robot's messages are suddenly " + milliseconds_text(*jump) +
           (jump->us > 0 ? " later" : " earlier") + " than before";
  }
  if (clocks_.agree()) return {};
  const bool was_just_stepped =
      step_time_ && now >= *step_time_ && now - *step_time_ < options_.step_settles;
  const bool is_far = std::abs(clocks_.offset().us) > options_.clock_tolerance.us;
  const bool is_suspicion = !clocks_.is_impossible() && clocks_.stepped().us == 0;
  const bool is_doubtful = was_just_stepped || is_suspicion || (clocks_.is_impossible() && is_far);
  return is_doubtful ? clocks_.complaint() : "";
}

bool CameraPredictor::set_controller(Time now, const ControllerState& controller) {
  const StampVerdict verdict = controller_order_.judge(now, controller.time);
  // Two changes in one instant are told one after the other.
  if (!is_taken(verdict) && verdict != StampVerdict::kRepeated) return false;
  controller_ = controller;
  if (is_told(controller.limits)) static_cast<void>(limits_.offer(controller.limits));
  return true;
}

bool CameraPredictor::set_alignment(const Alignment& alignment) {
  newest_alignment_ = alignment;
  const bool agrees = base_epoch_.value() == alignment.epoch;
  if (!alignment_epoch_.offer(alignment.epoch) && !agrees) return false;
  alignment_ = alignment;
  return true;
}

bool CameraPredictor::set_base(Time now, const BaseState& base) {
  if (!is_near(base.world_from_base.translation()) || !is_near(base.velocity_m_per_s) ||
      !is_near(base.angular_velocity_rad_per_s)) {
    return false;
  }
  const StampVerdict verdict = base_order_.judge(now, base.time);
  if (!is_taken(verdict) || !base_epoch_.offer(base.epoch)) return false;
  const bool continues = verdict == StampVerdict::kNewer && base_ && base_->epoch == base.epoch;
  if (!continues) recent_bases_.clear();
  if (newest_alignment_ && newest_alignment_->epoch == base.epoch) alignment_ = newest_alignment_;
  base_ = base;
  recent_bases_.push_back(base);
  while (base.time - recent_bases_.front().time > kAccelerationWindow) recent_bases_.pop_front();
  find_base_acceleration();
  return true;
}

// The slope of the last velocities (least squares).
void CameraPredictor::find_base_acceleration() {
  base_acceleration_m_per_s2_.setZero();
  base_angular_acceleration_rad_per_s2_.setZero();
  const Time newest = recent_bases_.back().time;
  if (newest - recent_bases_.front().time < milliseconds(190)) return;
  double mean_s = 0;
  for (const BaseState& b : recent_bases_) mean_s += (b.time - newest).seconds();
  mean_s /= static_cast<double>(recent_bases_.size());
  double spread_s2 = 0;
  for (const BaseState& b : recent_bases_) {
    const double t = (b.time - newest).seconds() - mean_s;
    spread_s2 += t * t;
    base_acceleration_m_per_s2_ += t * b.velocity_m_per_s;
    base_angular_acceleration_rad_per_s2_ += t * b.angular_velocity_rad_per_s;
  }
  base_acceleration_m_per_s2_ /= spread_s2;
  base_angular_acceleration_rad_per_s2_ /= spread_s2;
}

std::string CameraPredictor::missing(Time now) const {
  if (!state_) return "no JOINT_STATE yet";
  if (state_watch_.is_clock_set_back(now)) return "the clock here was set back";
  if (state_watch_.is_silent(now, options_.longest_silence)) {
    return "no JOINT_STATE for " + seconds_text(*state_watch_.silence(now), 1);
  }
  if (const std::string doubt = clock_doubt(now); !doubt.empty()) return doubt;
  if (!alignment_) return "map and robot are not aligned yet";
  if (!base_ || base_->epoch != alignment_->epoch) return "no BASE_POSE yet";
  return {};
}

std::optional<PredictedCamera> CameraPredictor::predict(Time now) {
  reason_ = missing(now);
  if (!reason_.empty()) return std::nullopt;
  PredictedCamera predicted;
  predicted.instant = now + command_delay();
  predicted.epoch = alignment_->epoch;
  const Forecast forecast = run_reference(predicted.instant);
  const JointCommand* newest = commands_.newest_of(forecast.driver);
  const bool shows_command =
      options_.joints == PredictedJoints::kCommand && newest != nullptr && newest->is_engaged;
  predicted.position_rad = shows_command
                               ? arm_.clamp(newest->position_rad, limits().joint_margin_rad)
                               : forecast.position_rad;
  if (newest == nullptr) newest = commands_.newest();
  predicted.command_time = newest == nullptr ? Time{} : newest->time;
  predicted.world_from_base = predict_base(predicted.instant);
  predicted.world_from_cam = predicted.world_from_base * arm_.base_from_ee(predicted.position_rad) *
                             alignment_->ee_from_cam;
  predicted.map_from_cam = alignment_->world_from_map.inverse() * predicted.world_from_cam;
  return predicted;
}

// CONTROLLER_STATE says it; JOINT_STATE, which comes more often, says it sooner: the sender of the
// command that the reference was fitted to last.
int64_t CameraPredictor::known_driver() const {
  if (controller_ && controller_->driver_session != 0) return controller_->driver_session;
  const bool may_follow = !controller_ || controller_->state == ArmState::kFollowing;
  return may_follow && state_ && state_->command_time.us != 0
             ? commands_.who_gave(state_->command_time)
             : 0;
}

// Who drove, and who had been let go, when the commands given until `command_time` had arrived.
DriverRule::Start CameraPredictor::driver_then(Time command_time) const {
  DriverRule::Start start{known_driver(), state_->command_arrival, {}};
  const bool nobody_is_released = controller_ && controller_->needs_release;
  for (const JointCommand* command : commands_.newest_until(command_time)) {
    const Time arrival = command->time + command_delay();
    if (command->session == start.driver) {
      // What JOINT_STATE alone tells may be that it has let go.
      if (!command->is_engaged && !controller_) start.driver = 0;
      start.driver_arrival = std::max(start.driver_arrival, arrival);
    }
    if (!command->is_engaged && !nobody_is_released) {
      start.released.push_back({command->session, arrival});
    }
  }
  return start;
}

// What the reference has been fitted to has arrived; all else arrives after it.
Time CameraPredictor::arrival_of(const JointCommand& command) const {
  const Time usual = command.time + command_delay();
  if (command.time <= state_->command_time) return std::min(usual, state_->command_arrival);
  return std::max(usual, state_->time);
}

// The controller's reference, carried on from the newest state. A fitted profile re-fitted from its
// middle is the same profile, so going on to the state's target changes nothing.
CameraPredictor::Forecast CameraPredictor::run_reference(Time instant) const {
  const JointState& s = *state_;
  if (controller_ && !is_powered(*controller_)) return {s.position_rad, 0};
  JointReference reference(limits().motion);
  reference.begin(s.time, s.reference_rad, s.reference_velocity_rad_per_s);
  reference.follow(s.time, s.target_rad);
  Time known = s.command_time;
  if (controller_) {
    known = std::min(known, controller_->time - command_delay() - kArrivalMargin);
  }
  DriverRule rule(driver_then(known), limits().command_timeout);
  const auto let_lease_end = [&](Time now) {
    const Time end = rule.lease_end();
    if (rule.expire(now) == ArmDoes::kStop) reference.stop(std::max(s.time, end));
  };
  for (const JointCommand* command : commands_.after(known)) {
    const Time arrival = arrival_of(*command);
    if (arrival > instant) break;
    let_lease_end(arrival);
    const ArmDoes does = rule.admit(arrival, *command);
    if (command->time <= s.command_time) continue;  // is in the reference
    if (does == ArmDoes::kStop) reference.stop(arrival);
    if (does != ArmDoes::kFollow) continue;
    reference.follow(arrival, arm_.clamp(command->position_rad, limits().joint_margin_rad));
  }
  let_lease_end(instant);
  // What the arm lags behind its reference (friction, mostly) it will lag then.
  const JointVector lag_rad = s.position_rad - s.reference_rad;
  return {reference.at(std::max(instant, s.time)).position_rad + lag_rad, rule.driver()};
}

std::string CameraPredictor::commanders_complaint(Time now) const {
  const std::vector<int64_t> engaged = commands_.engaged(now);
  const int64_t driver = controller_ ? controller_->driver_session : 0;
  if (engaged.size() > 1) {
    std::string line = std::to_string(engaged.size()) + " senders command the arm at once: started";
    for (const int64_t session : engaged) {
      line += (session == engaged.front() ? " " : ", ") + age_text(now, session);
    }
    return driver == 0 ? line : line + "; it follows the one of " + age_text(now, driver);
  }
  if (driver == 0 || commands_.newest() == nullptr || commands_.newest_of(driver) != nullptr) {
    return {};
  }
  return "the arm follows a sender that is not at this site (started " + age_text(now, driver) +
         ")";
}

std::string CameraPredictor::limits_note() const {
  if (!limits_.value() || *limits_.value() == options_.limits) return {};
  std::string note;
  const auto compare = [&note](double told, double own, const char* unit) {
    if (told == own) return;
    note += (note.empty() ? "" : ", ") + number_text(told) + " " + unit + " instead of " +
            number_text(own) + " " + unit;
  };
  const ControllerLimits &told = *limits_.value(), &own = options_.limits;
  compare(told.motion.velocity, own.motion.velocity, "rad/s");
  compare(told.motion.acceleration, own.motion.acceleration, "rad/s^2");
  compare(told.joint_margin_rad, own.joint_margin_rad, "rad of margin");
  compare(told.command_timeout.seconds(), own.command_timeout.seconds(), "s of time-out");
  return "the controller's limits are followed: " + note;
}

Pose<World, Base> CameraPredictor::predict_base(Time instant) const {
  const Duration ahead =
      std::clamp(instant - base_->time, Duration{}, options_.longest_extrapolation);
  const double t_s = ahead.seconds();
  // Accelerations do not last: they are carried on for a while only.
  const double bent_s2 = std::pow(std::min(t_s, kAccelerationLasts.seconds()), 2) / 2;
  const Eigen::Vector3d turn =
      base_->angular_velocity_rad_per_s * t_s + base_angular_acceleration_rad_per_s2_ * bent_s2;
  const double angle = turn.norm();
  const Eigen::AngleAxisd rotation(
      angle, angle > 1e-12 ? Eigen::Vector3d(turn / angle) : Eigen::Vector3d::UnitX());
  return {Eigen::Quaterniond(rotation) * base_->world_from_base.rotation(),
          base_->world_from_base.translation() + base_->velocity_m_per_s * t_s +
              base_acceleration_m_per_s2_ * bent_s2};
}

}  // namespace foresight
