// Lets in the operator's commands that may move the arm, says who drives, and counts the others.
//
//   CommandGate gate({.joint_count = arm.size(), .max_age = seconds(2), .lease = seconds(0.5)});
//   if (gate.admit(arrival, command, arm_is_active) == CommandVerdict::kAccepted) …
//   gate.expire(now);    // the driver's lease
//   gate.revoke();       // after any loss of power, mode or feedback
//
// A session *drives* from a fresh engage until it lets go or nothing acceptable comes from it for
// the lease. An engage is fresh when the arm is active, nobody drives, and the session was seen let
// go since the arm became active, since anybody else drove while it was engaged, and since its
// commands were last silent for longer than the lease. While it drives, engaged commands of others
// are dropped, and their letting go changes nothing.
//
// Within a session seq orders: a letting go overtakes every older command. After a silence longer
// than the lease stamps order instead, so that one absurd seq cannot lock a session out. The last
// kSessions senders are remembered, so that an old session's commands are not taken for new ones.
//
// An engaged command is late, and dropped as stale, when it travelled longer than the session's
// quickest one of the last seconds by more than the lease: it comes out of a stall, and its sender
// has meant something else since. No allocation, no exceptions.
#pragma once

#include <array>
#include <cstdint>

#include "common/robot_types.h"

namespace foresight {

enum class CommandVerdict : uint8_t {
  kAccepted,
  kOutOfOrder,
  kStale,
  kMisshapen,     // no session, wrong joint count, or no number
  kAhead,         // stamped in the future
  kOfOthers,      // engaged, but another session drives
  kNeedsRelease,  // engaged, but not freshly
};
constexpr int kCommandVerdicts = 7;

struct CommandGateOptions {
  int joint_count = 0;
  Duration max_age{2'000'000};  // on both sides of now
  Duration lease{500'000};
};

class CommandGate {
 public:
  explicit CommandGate(const CommandGateOptions& options) : options_(options) {}

  /// Letting go needs no joint positions, and the driver's needs no good stamp either.
  [[nodiscard]] CommandVerdict admit(Time arrival, const JointCommand& command, bool arm_is_active);
  /// Ends the lease of whoever has been silent.
  void expire(Time now);
  /// From now on everybody must be seen let go before he drives.
  void revoke();

  bool has_driver() const { return driver_ != nullptr; }
  int64_t driver_session() const { return has_driver() ? driver_->id : 0; }
  /// Somebody else drives.
  bool is_aside(int64_t session) const { return has_driver() && driver_->id != session; }
  /// Nobody drives, and nobody could by engaging: no sender has been seen let go.
  bool needs_release() const;
  int64_t count(CommandVerdict verdict) const { return counts_[static_cast<size_t>(verdict)]; }

 private:
  static constexpr size_t kSessions = 8;
  struct Session {
    bool is_known = false, is_released = false;
    int64_t id = 0, seq = 0;
    Time time, arrival;  // stamp and arrival of the newest command
    // The shortest way of its commands: in this stretch of time, and in the one before.
    Duration shortest_way, shortest_way_before;
    Time stretch_began;
  };

  CommandVerdict judge(Time arrival, const JointCommand& command, bool arm_is_active);
  CommandVerdict judge_stamps(Time arrival, const JointCommand& command) const;
  CommandVerdict judge_engaged(Time arrival, Session& session, bool arm_is_active);
  bool is_silent(Time last, Time now) const;
  bool is_in_order(const Session& session, Time arrival, const JointCommand& command) const;
  bool fits(const JointCommand& command) const;
  Session* find(int64_t id);
  Session& open(int64_t id, Time arrival, Duration way_now);
  void note(Session& session, Time arrival, const JointCommand& command) const;

  CommandGateOptions options_;
  std::array<Session, kSessions> sessions_;
  Session* driver_ = nullptr;  // into sessions_
  Time driver_arrival_;        // of his last accepted command
  std::array<int64_t, kCommandVerdicts> counts_{};
};

}  // namespace foresight
