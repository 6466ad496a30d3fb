// When to answer requests for a whole state: at once, but at most once in kSnapshotInterval,
// however many ask. One snapshot serves everybody who asked before it, and a request costs a
// comparison, so a flood of them neither silences the sender nor fills the network.
//
//   if (const auto due = gate.request(node.now())) {
//     if (*due <= node.now()) send(); else node.at(*due, send);   // send() calls
//     gate.answered(now)
//   }
#pragma once

#include <optional>

#include "common/time.h"

namespace foresight {

/// Between two snapshots of a sender, and between two requests of a receiver. Who doubts what he
/// has waits so long (delta_stream.h), one process after the other: carver for slam, mesher for
/// carver.
constexpr Duration kSnapshotInterval = milliseconds(500);

class SnapshotGate {
 public:
  /// Somebody asks. When this request is to be answered: now or later; nothing when an answer that
  /// serves it too is on its way.
  [[nodiscard]] std::optional<Time> request(Time now) {
    if (waiting_) return std::nullopt;
    waiting_ = true;
    // A clock that was set back must not make anybody wait for the old time to come again.
    const bool free = !has_answered_ || now < answered_ || now - answered_ >= kSnapshotInterval;
    return free ? now : answered_ + kSnapshotInterval;
  }
  /// The whole state is being sent (or there is none): who asks from now on gets the next one.
  void answered(Time now) {
    waiting_ = false;
    has_answered_ = true;
    answered_ = now;
  }

 private:
  bool waiting_ = false, has_answered_ = false;
  Time answered_;  // the last time
};

}  // namespace foresight
