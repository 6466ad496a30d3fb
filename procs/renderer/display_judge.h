// What the renderer's health says: one state and one line from all facts together, once a second.
// Nobody else sets the state, so no complaint overwrites another.
//
//   DisplayJudge judge;
//   const DisplayVerdict verdict = judge.judge({.now = now, .pictures = drawn, …});
//   node.set_state(…, verdict.reason);            // all complaints, worst first
//
// OK means: what the operator sees is as good as it usually is.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/time.h"
#include "procs/renderer/stream_watch.h"

namespace foresight {

struct StreamFacts {
  std::string name;  // of its channel
  StreamWatch watch;
  Duration slack;  // silence beyond its usual interval that is nothing to speak of
};

/// Empty strings: nothing to complain about.
struct DisplayFacts {
  Time now = {};
  int64_t pictures = 0;        // drawn since the start
  Duration redraw_after = {};  // the longest time between two pictures while all is well
  Duration stood_still = {};   // of the process, by the machine's own clock
  bool has_video = false;
  bool has_prediction = false;         // in the last picture
  std::string prediction_reason = {};  // why not
  std::string clocks = {};             // how the two sites' clocks disagree
  std::vector<StreamFacts> streams = {};
  std::string commanders = {};         // who else commands the arm
  std::string arm = {};                // why it is not the arm that this site takes it for
  std::optional<Duration> delay = {};  // now, there and back
  std::optional<Duration> normal_delay = {};
  std::string recording = {};
  std::string note = {};  // worth knowing, and nothing wrong
};

enum class DisplayState : uint8_t { kWaiting, kOk, kDegraded };

struct DisplayVerdict {
  DisplayState state = DisplayState::kWaiting;
  std::string reason;
};

class DisplayJudge {
 public:
  DisplayVerdict judge(const DisplayFacts& facts);

 private:
  std::string drawing_complaint(const DisplayFacts& facts);

  bool has_predicted_ = false;
  int64_t pictures_ = 0;
  std::optional<Time> picture_time_;
};

}  // namespace foresight
