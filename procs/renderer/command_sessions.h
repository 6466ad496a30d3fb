// The operator's commands as they are given, by sender, and whose of them the arm will follow: the
// rule of wam_controller's command gate, repeated for what is still on its way.
//
//   CommandSessions sessions(arm.size());
//   if (sessions.add(now, command) != CommandIntake::kTaken) …
//   for (const JointCommand* c : sessions.after(time)) …            // by time
//
//   DriverRule rule(sessions, {.driver = …}, timeout);   // as CONTROLLER_STATE says it was
//   if (rule.admit(arrival, command) == ArmDoes::kFollow) …
//
// A sender drives from a fresh engage, while nobody else drives, until it lets go or is silent for
// the time-out. An engage is fresh when the sender was seen let go before, and has been neither
// silent nor engaged in vain since. Of those who do not drive nothing moves the arm.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "common/newest_stamp.h"
#include "common/robot_types.h"
#include "common/time.h"

namespace foresight {

enum class CommandIntake : uint8_t {
  kTaken,
  kOtherArm,  // another number of joints
  kFuture,    // it, or the start of its sender
  kStale,
  kOld,  // not newer than its sender's last
};
const char* to_string(CommandIntake intake);

class CommandSessions {
 public:
  explicit CommandSessions(int joint_count) : joint_count_(joint_count) {}

  /// Remembers the commands of the last kSessions senders; `kept` is the one that nobody displaces.
  [[nodiscard]] CommandIntake add(Time now, const JointCommand& command, int64_t kept);
  /// All commands given after an instant, by time.
  std::vector<const JointCommand*> after(Time time) const;
  /// The newest command of each sender that was given at `time` at the latest.
  std::vector<const JointCommand*> newest_until(Time time) const;
  const JointCommand* newest() const;
  const JointCommand* newest_of(int64_t session) const;
  /// Who gave the command of this instant; 0: nobody that is remembered.
  int64_t who_gave(Time time) const;
  /// Senders that engaged in the second before `now`.
  std::vector<int64_t> engaged(Time now) const;

 private:
  static constexpr size_t kSessions = 8;
  struct Session {
    int64_t id = 0;
    NewestStamp order;
    std::deque<JointCommand> commands;  // by time
    Time arrival;
    std::optional<Time> engaged;  // when it last was
  };
  Session* find_or_open(int64_t id, int64_t kept);

  int joint_count_;
  std::vector<Session> sessions_;
};

enum class ArmDoes : uint8_t { kNothing, kFollow, kStop };

class DriverRule {
 public:
  /// Who was seen let go, and when last: it is forgotten after the time-out.
  struct Released {
    int64_t session = 0;
    Time arrival;
  };
  struct Start {
    int64_t driver = 0;  // 0: nobody
    Time driver_arrival;
    std::vector<Released> released;
  };
  DriverRule(Start start, Duration timeout) : now_(std::move(start)), timeout_(timeout) {}

  /// In order of arrival. kStop: the driver lets go.
  ArmDoes admit(Time arrival, const JointCommand& command);
  /// Ends the driver's lease; kStop when that was at or before `now`.
  ArmDoes expire(Time now);
  int64_t driver() const { return now_.driver; }
  /// When the driver's lease ends unless he commands again.
  Time lease_end() const { return now_.driver_arrival + timeout_; }

 private:
  bool is_released(int64_t session, Time now) const;
  void forget(int64_t session);

  Start now_;
  Duration timeout_;
};

}  // namespace foresight
