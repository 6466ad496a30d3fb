// What is wrong with the commands that arrive, in words for people: engaged ones that are all
// dropped and why, a second operator, an operator's clock that is ahead or was set.
//
//   CommandWatch watch;
//   watch.on_command(arrival, command, verdict);        // every one
//   watch.on_time(now, malformed);                      // ten times a second, say
//   if (!watch.complaint().empty()) …
//
// Judged once a second over that second, so a complaint comes within two seconds of its cause, and
// goes as soon. A command that comes from the future proves that clocks differ, and by how much at
// least; one from the past proves nothing, for it may have travelled.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>

#include "procs/wam_controller/command_gate.h"

namespace foresight {

class CommandWatch {
 public:
  void on_command(Time arrival, const JointCommand& command, CommandVerdict verdict);
  /// The clock here has become another one (a simulated world that began anew). That of the
  /// operator's site follows, and what is under way still has stamps of before: no clock was set.
  void on_clock_change(Time now);
  /// `malformed`: datagrams that were refused before they became a command, since the start.
  void on_time(Time now, int64_t malformed);

  /// Empty while there is nothing to say.
  const std::string& complaint() const { return complaint_; }
  /// Of the newest command: arrival − stamp. Negative only if clocks differ.
  double age_ms() const { return age_.seconds() * 1e3; }
  /// The operator's clock is ahead of this one by at least so much; 0: nothing proves it.
  double clock_ahead_ms() const { return clock_ahead_.seconds() * 1e3; }

 private:
  static constexpr Duration kNoAge{INT64_MAX};

  struct Second {
    int64_t commands = 0, followed = 0, malformed = 0;
    std::array<int64_t, kCommandVerdicts> dropped{};  // engaged ones, by verdict
    Duration longest_age;
    int64_t other_session = 0;
  };

  void look_for_step(Time arrival, const JointCommand& command);
  void suspect_step(Duration jump);
  bool ages_confirm_step() const;
  void note_age(Time arrival, Duration age);
  /// The least of the last second or two: what the way takes when nothing stands still.
  Duration usual_age() const { return std::min(least_age_.of_last, least_age_.of_this); }
  std::string describe(Time now) const;
  std::string describe_drops() const;

  Second second_;
  Time second_began_;
  std::string complaint_;
  int64_t malformed_ = 0;
  Duration age_, clock_ahead_;
  // The last command, to see a clock that is set: stamps jump though seq goes on.
  struct Last {
    bool is_known = false;
    int64_t session = 0, seq = 0;
    Time stamp, arrival;
    Duration period;  // of its sender; 0: not known yet
  } last_;
  struct LeastAge {
    Time second_began;
    Duration of_last = kNoAge, of_this = kNoAge;
  } least_age_;
  Duration suspected_step_;  // until the commands that follow confirm it, or take it back
  Duration age_before_step_, least_age_since_step_;
  int confirmations_ = 0;
  Duration clock_step_;
  Time clock_stepped_at_;
  bool has_settled_ = true;  // since the clock here has changed
  Time settles_at_;
};

}  // namespace foresight
