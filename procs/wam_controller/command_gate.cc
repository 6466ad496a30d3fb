#include "procs/wam_controller/command_gate.h"

#include <algorithm>

namespace foresight {
namespace {

// A sender starts before it sends, so its session may lie in the future by what clocks differ only.
constexpr Duration kSessionAhead = seconds(1);
// More commands cannot be lost in between without a silence.
constexpr uint64_t kLargestSeqStep = 10'000;
// How long the shortest way of a session's commands is remembered, at least; longer than max_age
// usually is, so that a stall does not outlast it.
constexpr Duration kStretch = seconds(3);

// Nothing travels for less than no time: a stamp from the future must not make the others late.
Duration way(Time arrival, const JointCommand& command) {
  return std::max(arrival - command.time, Duration{});
}

}  // namespace

CommandVerdict CommandGate::admit(Time arrival, const JointCommand& command, bool arm_is_active) {
  expire(arrival);
  const CommandVerdict verdict = judge(arrival, command, arm_is_active);
  ++counts_[static_cast<size_t>(verdict)];
  return verdict;
}

CommandVerdict CommandGate::judge(Time arrival, const JointCommand& command, bool arm_is_active) {
  Session* session = find(command.session);
  const bool lets_go_of_arm = has_driver() && session == driver_ && !command.is_engaged &&
                              (command.seq > session->seq || command.time > session->time);
  if (lets_go_of_arm) driver_ = nullptr;
  const CommandVerdict stamps = judge_stamps(arrival, command);
  if (stamps != CommandVerdict::kAccepted) {
    if (lets_go_of_arm) session->is_released = false;
    return stamps;
  }
  if (session != nullptr && !is_in_order(*session, arrival, command)) {
    if (lets_go_of_arm) session->is_released = false;
    return CommandVerdict::kOutOfOrder;
  }
  if (command.session <= 0 || (command.is_engaged && !fits(command))) {
    return CommandVerdict::kMisshapen;
  }
  if (session == nullptr) {
    session = &open(command.session, arrival, way(arrival, command));
  }
  note(*session, arrival, command);
  if (command.is_engaged) return judge_engaged(arrival, *session, arm_is_active);
  session->is_released = arm_is_active;
  return CommandVerdict::kAccepted;
}

// Comparisons add to one side only and after a bound, so that absurd stamps cannot overflow.
CommandVerdict CommandGate::judge_stamps(Time arrival, const JointCommand& command) const {
  if (command.time > arrival + options_.max_age) return CommandVerdict::kAhead;
  if (command.session > (arrival + kSessionAhead).us) return CommandVerdict::kAhead;
  if (command.time < arrival - options_.max_age) return CommandVerdict::kStale;
  return CommandVerdict::kAccepted;
}

CommandVerdict CommandGate::judge_engaged(Time arrival, Session& session, bool arm_is_active) {
  const Duration shortest = std::min(session.shortest_way, session.shortest_way_before);
  if (session.arrival - session.time > shortest + options_.lease) return CommandVerdict::kStale;
  if (is_aside(session.id)) {
    session.is_released = false;
    return CommandVerdict::kOfOthers;
  }
  if (!has_driver() && !(arm_is_active && session.is_released)) {
    return CommandVerdict::kNeedsRelease;
  }
  driver_ = &session;
  driver_arrival_ = arrival;
  return CommandVerdict::kAccepted;
}

bool CommandGate::is_silent(Time last, Time now) const {
  return now - last > options_.lease || now - last < options_.lease * -1;  // or a clock was set
}

bool CommandGate::is_in_order(const Session& session, Time arrival,
                              const JointCommand& command) const {
  if (arrival < session.arrival - options_.lease) return true;  // this clock was set back
  if (is_silent(session.arrival, arrival)) return command.time > session.time;
  const uint64_t step = static_cast<uint64_t>(command.seq) - static_cast<uint64_t>(session.seq);
  return command.seq > session.seq && step <= kLargestSeqStep;
}

bool CommandGate::fits(const JointCommand& command) const {
  return command.position_rad.size() == options_.joint_count && command.position_rad.allFinite();
}

CommandGate::Session* CommandGate::find(int64_t id) {
  for (Session& session : sessions_) {
    if (session.is_known && session.id == id) return &session;
  }
  return nullptr;
}

// In the place of the one that was not heard for longest (an empty place never was), but not of the
// driver's.
CommandGate::Session& CommandGate::open(int64_t id, Time arrival, Duration way_now) {
  Session* place = nullptr;
  for (Session& session : sessions_) {
    if (&session == driver_) continue;
    if (place == nullptr || session.arrival < place->arrival) place = &session;
  }
  *place = {};
  place->is_known = true;
  place->id = id;
  place->arrival = place->stretch_began = arrival;
  place->shortest_way = place->shortest_way_before = way_now;
  return *place;
}

void CommandGate::note(Session& session, Time arrival, const JointCommand& command) const {
  if (is_silent(session.arrival, arrival)) session.is_released = false;
  session.seq = command.seq;
  session.time = command.time;
  session.arrival = arrival;
  const Duration way_now = way(arrival, command);
  const Duration in_stretch = arrival - session.stretch_began;
  if (in_stretch > kStretch || in_stretch < Duration{}) {
    session.shortest_way_before = session.shortest_way;
    session.shortest_way = way_now;
    session.stretch_began = arrival;
  }
  session.shortest_way = std::min(session.shortest_way, way_now);
}

void CommandGate::expire(Time now) {
  if (has_driver() && is_silent(driver_arrival_, now)) {
    driver_->is_released = false;
    driver_ = nullptr;
  }
  for (Session& session : sessions_) {
    if (is_silent(session.arrival, now)) session.is_released = false;
  }
}

void CommandGate::revoke() {
  driver_ = nullptr;
  for (Session& session : sessions_) session.is_released = false;
}

bool CommandGate::needs_release() const {
  return !has_driver() && std::none_of(sessions_.begin(), sessions_.end(),
                                       [](const Session& s) { return s.is_released; });
}

}  // namespace foresight
