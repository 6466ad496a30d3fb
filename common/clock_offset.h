// Whether the clocks of the two sites agree, from the stamps that come back with JOINT_STATE: the
// robot tells when it measured, which command it had dealt with and when that one had arrived.
//
//   ClockOffset clocks;
//   clocks.add({now, state.time, state.command_time, state.command_arrival});  // each JOINT_STATE
//   if (!clocks.complaint().empty()) …                          // "the robot's clock is 300 ms
//   ahead"
//
// With θ = the robot's clock − the operator's, what the stamps show is
//   downlink = now − robot_time               = delay to the operator − θ
//   uplink   = command_arrival − command_time = delay to the robot + θ
//   round trip = uplink + downlink            = both delays, whatever θ.
// What is certain: delays are not negative, so −downlink ≤ θ ≤ uplink; a latency below zero is
// impossible with clocks that agree. A clock that is stepped changes both by the same amount in
// opposite senses and leaves their sum, which delays do not do by chance: a step is taken as
// certain too. What is assumed: the offset as a number is the middle of its bounds, as if both
// directions were delayed alike; it is wrong by at most half a round trip.
//
// Delays vary, so steps are looked for between the least latencies of seconds. Of a step of its own
// clock the operator's site first sees the downlink's half; the rest comes a round trip later. A
// step so large that the robot refuses every command never shows its second half: then there is but
// a suspicion, and the complaint says so. No clock, no allocation but of text. O(1).
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <string>

#include "common/time.h"

namespace foresight {

struct ClockSample {
  Time now;              // the operator's clock when JOINT_STATE arrived
  Time robot_time;       // the robot's clock: when the joints were measured
  Time command_time;     // the operator's clock: of the newest command dealt with; 0: none
  Time command_arrival;  // the robot's clock: when that one arrived
};

struct ClockOffsetOptions {
  Duration tolerance = milliseconds(5);    // so far below zero a latency is still possible
  Duration least_step = milliseconds(50);  // smaller ones pass for jitter
  Duration command_age = seconds(1.0);     // an uplink that is older says nothing about now
};

class ClockOffset {
 public:
  explicit ClockOffset(const ClockOffsetOptions& options = {}) : options_(options) {}

  /// Samples may come at any rate and with any stamps; one counts when it agrees with the one
  /// before within half a second, and steps are looked for between seconds in which all agree.
  void add(const ClockSample& sample);

  /// Apparent latencies of the newest sample, negative where the clocks make them so. Nothing
  /// before the first sample; uplink and round trip: nor while no command arrives.
  std::optional<Duration> downlink() const { return downlink_; }
  std::optional<Duration> uplink() const { return uplink_; }
  std::optional<Duration> round_trip() const;

  /// Several samples running had a latency below zero, in this second or the last one.
  bool is_impossible() const { return window_.is_impossible || was_impossible_; }
  /// How far the robot's clock has been stepped ahead of the operator's since the first sample,
  /// as far as it has not been stepped back. Zero again when a step mends what was impossible.
  Duration stepped() const { return stepped_; }
  /// Both clocks can be relied on as far as is known: no complaint.
  bool agree() const { return complaint().empty(); }
  /// How far the robot's clock is ahead of the operator's (negative: behind); half a round trip at
  /// most away from the truth while commands arrive. Zero before the first sample.
  Duration offset() const;
  /// One line for people when the clocks differ or seem to; else empty.
  std::string complaint() const;

 private:
  // The least latencies of about a second.
  struct Window {
    std::optional<Duration> downlink, uplink;
    bool is_impossible = false, is_contradicted = false;
  };
  bool agrees_with_last(const ClockSample& sample);
  void look_for_impossible();
  void close_window();
  void look_for_step();
  void look_for_unanswered();
  size_t kept() const { return std::min(history_count_, kHistory); }
  /// 0: the newest.
  const Window& history(size_t i) const { return history_[(history_count_ - 1 - i) % kHistory]; }

  static constexpr size_t kHistory = 12;  // seconds: longer than round trips
  static constexpr int kRunning = 5;      // impossible samples that are no outliers

  ClockOffsetOptions options_;
  std::optional<ClockSample> last_;
  std::optional<Duration> downlink_, uplink_;
  int impossible_running_ = 0;
  bool was_impossible_ = false;
  Duration stepped_{0};
  Duration unanswered_{0};  // what the downlink has changed by while no command arrives
  std::optional<ClockSample> window_begin_;
  Window window_;
  std::array<Window, kHistory> history_;
  size_t history_count_ = 0;  // ever; the newest ones are kept
};

}  // namespace foresight
