#include "procs/renderer/command_sessions.h"

#include <algorithm>

namespace foresight {
namespace {

constexpr size_t kCommandsKept = 600;  // 20 s at 30 Hz
constexpr Duration kFuture = seconds(1), kStale = seconds(2), kEngagedLately = seconds(1);

}  // namespace

const char* to_string(CommandIntake intake) {
  switch (intake) {
    case CommandIntake::kTaken:
      return "taken";
    case CommandIntake::kOtherArm:
      return "has another number of joints than arm_file";
    case CommandIntake::kFuture:
      return "or its session is stamped in the future";
    case CommandIntake::kStale:
      return "is stamped more than 2 s ago";
    case CommandIntake::kOld:
      return "is not newer than its sender's last";
  }
  return "?";
}

CommandIntake CommandSessions::add(Time now, const JointCommand& command, int64_t kept) {
  if (command.position_rad.size() != joint_count_) return CommandIntake::kOtherArm;
  const Time latest = now + kFuture;
  if (command.time > latest || command.session > latest.us) return CommandIntake::kFuture;
  if (command.time < now - kStale) return CommandIntake::kStale;
  Session& session = *find_or_open(command.session, kept);
  const StampVerdict verdict = session.order.judge(now, command.time);
  if (!is_taken(verdict)) return CommandIntake::kOld;
  if (verdict == StampVerdict::kRestarted) session.commands.clear();
  session.commands.push_back(command);
  if (session.commands.size() > kCommandsKept) session.commands.pop_front();
  session.arrival = now;
  if (command.is_engaged) session.engaged = now;
  return CommandIntake::kTaken;
}

// In the place of the one that was not heard for longest.
CommandSessions::Session* CommandSessions::find_or_open(int64_t id, int64_t kept) {
  const auto found = std::find_if(sessions_.begin(), sessions_.end(),
                                  [id](const Session& s) { return s.id == id; });
  if (found != sessions_.end()) return &*found;
  if (sessions_.size() >= kSessions) {
    sessions_.erase(std::min_element(sessions_.begin(), sessions_.end(),
                                     [kept](const Session& a, const Session& b) {
                                       if ((a.id == kept) != (b.id == kept)) return b.id == kept;
                                       return a.arrival < b.arrival;
                                     }));
  }
  sessions_.emplace_back();
  sessions_.back().id = id;
  return &sessions_.back();
}

std::vector<const JointCommand*> CommandSessions::after(Time time) const {
  std::vector<const JointCommand*> later;
  for (const Session& session : sessions_) {
    const auto first = std::upper_bound(session.commands.begin(), session.commands.end(), time,
                                        [](Time t, const JointCommand& c) { return t < c.time; });
    for (auto c = first; c != session.commands.end(); ++c) later.push_back(&*c);
  }
  std::stable_sort(later.begin(), later.end(),
                   [](const auto* a, const auto* b) { return a->time < b->time; });
  return later;
}

std::vector<const JointCommand*> CommandSessions::newest_until(Time time) const {
  std::vector<const JointCommand*> newest;
  for (const Session& session : sessions_) {
    const auto next = std::upper_bound(session.commands.begin(), session.commands.end(), time,
                                       [](Time t, const JointCommand& c) { return t < c.time; });
    if (next != session.commands.begin()) newest.push_back(&*(next - 1));
  }
  return newest;
}

const JointCommand* CommandSessions::newest() const {
  const JointCommand* newest = nullptr;
  for (const Session& session : sessions_) {
    if (session.commands.empty()) continue;
    const JointCommand& last = session.commands.back();
    if (newest == nullptr || last.time > newest->time) newest = &last;
  }
  return newest;
}

const JointCommand* CommandSessions::newest_of(int64_t id) const {
  for (const Session& session : sessions_) {
    if (session.id == id && !session.commands.empty()) return &session.commands.back();
  }
  return nullptr;
}

int64_t CommandSessions::who_gave(Time time) const {
  for (const JointCommand* command : newest_until(time)) {
    if (command->time == time) return command->session;
  }
  return 0;
}

std::vector<int64_t> CommandSessions::engaged(Time now) const {
  std::vector<int64_t> ids;
  for (const Session& session : sessions_) {
    if (session.engaged && now - *session.engaged < kEngagedLately) ids.push_back(session.id);
  }
  return ids;
}

bool DriverRule::is_released(int64_t session, Time now) const {
  return std::any_of(now_.released.begin(), now_.released.end(), [&](const Released& r) {
    return r.session == session && now - r.arrival <= timeout_;
  });
}

void DriverRule::forget(int64_t session) {
  std::erase_if(now_.released, [session](const Released& r) { return r.session == session; });
}

ArmDoes DriverRule::admit(Time arrival, const JointCommand& command) {
  const bool drives = now_.driver != 0 && now_.driver == command.session;
  if (!command.is_engaged) {
    forget(command.session);
    now_.released.push_back({command.session, arrival});
    if (!drives) return ArmDoes::kNothing;
    now_.driver = 0;
    return ArmDoes::kStop;
  }
  if (!drives) {
    const bool begins = now_.driver == 0 && is_released(command.session, arrival);
    forget(command.session);
    if (!begins) return ArmDoes::kNothing;
    now_.driver = command.session;
  }
  now_.driver_arrival = arrival;
  return ArmDoes::kFollow;
}

ArmDoes DriverRule::expire(Time now) {
  if (now_.driver == 0 || now <= lease_end()) return ArmDoes::kNothing;
  forget(now_.driver);
  now_.driver = 0;
  return ArmDoes::kStop;
}

}  // namespace foresight
