#include "procs/wam_controller/command_gate.h"

namespace foresight {

// Comparisons add to one side only and after a bound, so that absurd stamps cannot overflow. A
// session from the future would lock out every later one, so it is refused.
CommandVerdict CommandGate::judge(Time arrival, const ArmCommand& command) const {
  const Time latest = arrival + max_age_;
  if (command.time > latest || command.session > latest.us) return CommandVerdict::kRefused;
  if (command.time < arrival - max_age_) return CommandVerdict::kStale;
  if (has_session_) {
    if (command.session < session_) return CommandVerdict::kOutOfOrder;
    if (command.session == session_ && command.seq <= seq_) return CommandVerdict::kOutOfOrder;
  }
  const bool fits =
      command.joint_count == joint_count_ && command.position_rad.size() == joint_count_;
  if (command.is_engaged && !(fits && command.position_rad.allFinite())) {
    return CommandVerdict::kRefused;
  }
  return CommandVerdict::kAccepted;
}

CommandVerdict CommandGate::admit(Time arrival, const ArmCommand& command) {
  const CommandVerdict verdict = judge(arrival, command);
  switch (verdict) {
    case CommandVerdict::kAccepted:
      has_session_ = true;
      session_ = command.session;
      seq_ = command.seq;
      ++counts_.accepted;
      break;
    case CommandVerdict::kOutOfOrder:
      ++counts_.out_of_order;
      break;
    case CommandVerdict::kStale:
      ++counts_.stale;
      break;
    case CommandVerdict::kRefused:
      ++counts_.refused;
      break;
  }
  return verdict;
}

}  // namespace foresight
