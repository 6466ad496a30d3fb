// When to answer requests for a whole state: at once, but at most once in `interval`, however many
// ask. One snapshot serves everybody who asked before it, and a request costs a comparison, so a
// flood of them neither silences the sender nor fills the network.
//
//   if (const auto due = gate.request(node.now())) {
//     if (*due <= node.now()) send(); else node.at(*due, send);   // send() calls
//     gate.answered(now)
//   }
#pragma once

#include <optional>

#include "common/time.h"

namespace foresight {

class SnapshotGate {
 public:
  explicit SnapshotGate(Duration interval = {1'000'000}) : interval_(interval) {}

  /// Somebody asks. When this request is to be answered: now or later; nothing when an answer that
  /// serves it too is on its way.
  [[nodiscard]] std::optional<Time> request(Time now) {
    if (waiting_) return std::nullopt;
    waiting_ = true;
    // A clock that was set back must not make anybody wait for the old time to come again.
    const bool free = !has_answered_ || now < answered_ || now - answered_ >= interval_;
    return free ? now : answered_ + interval_;
  }
  /// The whole state is being sent (or there is none): who asks from now on gets the next one.
  void answered(Time now) {
    waiting_ = false;
    has_answered_ = true;
    answered_ = now;
  }

 private:
  Duration interval_;
  bool waiting_ = false, has_answered_ = false;
  Time answered_;  // the last time
};

}  // namespace foresight
