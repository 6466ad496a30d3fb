// Whether somebody else commands the same arm: another omni at this site, or one elsewhere whose
// commands the arm's controller drops because we drive. Who drives is the controller's to decide
// (CONTROLLER_STATE); that there are two is for people to know.
//
//   RivalWatch rivals;
//   rivals.on_command(now, message.session, our_session);   // each JOINT_COMMAND at this site
//   rivals.on_dropped(now, state.commands_of_others);       // each CONTROLLER_STATE
//   show(rivals.complaint(now));
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/time.h"

namespace foresight {

class RivalWatch {
 public:
  void on_command(Time arrival, int64_t session, int64_t our_session) {
    if (session == our_session) return;
    rival_session_ = session;
    rival_at_ = arrival;
  }
  /// `count`: of engaged commands that were dropped because another session drives.
  void on_dropped(Time arrival, int64_t count) {
    if (dropped_ && count > *dropped_) dropped_at_ = arrival;
    dropped_ = count;
  }
  /// One line while there is somebody; else empty.
  std::string complaint(Time now) const {
    if (is_recent(rival_at_, now)) {
      return "somebody else commands at this site too (session " + std::to_string(rival_session_) +
             ")";
    }
    if (is_recent(dropped_at_, now)) return "another operator presses too, and is refused";
    return {};
  }

 private:
  static bool is_recent(const std::optional<Time>& at, Time now) {
    return at && now - *at <= kRecent;
  }
  static constexpr Duration kRecent = seconds(2.0);

  int64_t rival_session_ = 0;
  std::optional<Time> rival_at_, dropped_at_;
  std::optional<int64_t> dropped_;
};

}  // namespace foresight
