// Lets in the operator's commands that may move the arm: of the newest session, in order, fresh,
// with one number per joint. Counts the others.
//
//   CommandGate gate(arm.size(), seconds(2));
//   if (gate.admit(arrival, command) == CommandVerdict::kAccepted) …
//
// No allocation, no exceptions.
#pragma once

#include <cstdint>

#include "common/arm_model.h"
#include "common/time.h"

namespace foresight {

/// joint_command_t as a core type.
struct ArmCommand {
  Time time;                 // when the operator's device was read
  int64_t session = 0;       // when its sender started, µs; a greater one begins anew
  int64_t seq = 0;           // within the session
  bool is_engaged = false;   // dead-man switch
  int joint_count = 0;       // as received
  JointVector position_rad;  // joint_count numbers, at most kMaxJoints
};

enum class CommandVerdict : uint8_t { kAccepted, kOutOfOrder, kStale, kRefused };

struct CommandCounts {
  int64_t accepted = 0;
  int64_t out_of_order = 0;
  int64_t stale = 0;
  int64_t refused = 0;  // wrong joint count, no number, or stamped in the future
};

class CommandGate {
 public:
  CommandGate(int joint_count, Duration max_age) : joint_count_(joint_count), max_age_(max_age) {}

  /// Releasing the dead-man switch needs no joint positions: it is heeded whatever their count.
  [[nodiscard]] CommandVerdict admit(Time arrival, const ArmCommand& command);
  const CommandCounts& counts() const { return counts_; }

 private:
  CommandVerdict judge(Time arrival, const ArmCommand& command) const;

  int joint_count_;
  Duration max_age_;
  bool has_session_ = false;
  int64_t session_ = 0, seq_ = 0;
  CommandCounts counts_;
};

}  // namespace foresight
