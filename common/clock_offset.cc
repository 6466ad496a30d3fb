#include "common/clock_offset.h"

#include <algorithm>
#include <cmath>

namespace foresight {
namespace {

constexpr Duration kWindow = seconds(1.0);
// Between the least latencies of two seconds: what jitter leaves of it.
constexpr Duration kSumTolerance = milliseconds(20);
// Of a downlink while no command arrives: the controller refuses what is 2 s from its clock.
constexpr Duration kSuspicious = seconds(1.0);
constexpr Duration kAgreement = milliseconds(500);
constexpr double kLongest_us = 1e15;  // 30 years

// Stamps come from outside: absurd ones must not overflow.
Duration difference(Time a, Time b) {
  const double us = static_cast<double>(a.us) - static_cast<double>(b.us);
  return {static_cast<int64_t>(std::clamp(us, -kLongest_us, kLongest_us))};
}

Duration size_of(Duration d) { return {std::abs(d.us)}; }

void keep_least(std::optional<Duration>* least, std::optional<Duration> value) {
  if (value && (!*least || *value < **least)) *least = value;
}

bool is_whole(Time begin, Time now) { return size_of(difference(now, begin)) >= kWindow; }

std::string text(Duration d) { return std::to_string(std::abs(d.us) / 1000) + " ms"; }

std::string ahead_or_behind(Duration d) { return text(d) + (d.us > 0 ? " ahead" : " behind"); }

}  // namespace

// One absurd sample among good ones agrees with neither neighbour.
bool ClockOffset::agrees_with_last(const ClockSample& sample) {
  const bool agrees = last_ &&
                      size_of(difference(sample.now, sample.robot_time) -
                              difference(last_->now, last_->robot_time)) < kAgreement &&
                      size_of(difference(sample.command_arrival, sample.command_time) -
                              difference(last_->command_arrival, last_->command_time)) < kAgreement;
  const bool is_first = !last_;
  last_ = sample;
  return agrees || is_first;
}

void ClockOffset::add(const ClockSample& sample) {
  if (!agrees_with_last(sample)) {
    window_.is_contradicted = true;
    return;
  }
  if (!window_begin_) window_begin_ = sample;
  if (is_whole(window_begin_->now, sample.now) ||
      is_whole(window_begin_->robot_time, sample.robot_time)) {
    close_window();
    window_begin_ = sample;
  }
  downlink_ = difference(sample.now, sample.robot_time);
  uplink_.reset();
  const Duration age = difference(sample.robot_time, sample.command_arrival);
  if (sample.command_time.us != 0 && size_of(age) <= options_.command_age) {
    uplink_ = difference(sample.command_arrival, sample.command_time);
  }
  look_for_impossible();
  keep_least(&window_.downlink, downlink_);
  keep_least(&window_.uplink, uplink_);
}

std::optional<Duration> ClockOffset::round_trip() const {
  if (!downlink_ || !uplink_) return std::nullopt;
  return *downlink_ + *uplink_;
}

void ClockOffset::look_for_impossible() {
  const Duration least = options_.tolerance * -1;
  const bool is_impossible = *downlink_ < least || (uplink_ && *uplink_ < least);
  impossible_running_ = is_impossible ? std::min(impossible_running_ + 1, kRunning) : 0;
  if (impossible_running_ == kRunning) window_.is_impossible = true;
}

void ClockOffset::close_window() {
  if (window_.is_contradicted) {
    // What is of two minds tells nothing: the next one does.
  } else if (window_.uplink) {
    unanswered_ = Duration{0};
    look_for_step();
    history_[history_count_++ % kHistory] = window_;
  } else {
    look_for_unanswered();
  }
  was_impossible_ = window_.is_impossible;
  window_ = Window();
}

void ClockOffset::look_for_step() {
  for (size_t i = 0; i < kept(); ++i) {
    const Window& before = history(i);
    const Duration down = *window_.downlink - *before.downlink;
    const Duration up = *window_.uplink - *before.uplink;
    const Duration step{(up.us - down.us) / 2};
    if (size_of(step) < options_.least_step || size_of(up + down) > kSumTolerance) continue;
    const bool mends = before.is_impossible && !window_.is_impossible;
    stepped_ = mends ? Duration{0} : stepped_ + step;
    if (size_of(stepped_) < options_.least_step) stepped_ = Duration{0};
    history_count_ = 0;  // what was before the step is not compared again
    return;
  }
}

void ClockOffset::look_for_unanswered() {
  for (size_t i = 0; i < kept(); ++i) {
    const Duration later = *window_.downlink - *history(i).downlink;
    if (size_of(later) > size_of(unanswered_)) unanswered_ = later;
  }
}

Duration ClockOffset::offset() const {
  if (!downlink_) return Duration{0};
  if (!uplink_) return std::max(Duration{0}, *downlink_ * -1);
  // Less than no round trip: a clock has just been stepped, and one half is still of before.
  if (round_trip()->us < 0) return downlink_->us < 0 ? *downlink_ * -1 : *uplink_;
  return {(uplink_->us - downlink_->us) / 2};
}

std::string ClockOffset::complaint() const {
  if (is_impossible() && size_of(offset()) > options_.tolerance) {
    return "the robot's clock is " + ahead_or_behind(offset());
  }
  if (stepped_.us != 0) return "the robot's clock was stepped " + ahead_or_behind(stepped_);
  if (size_of(unanswered_) >= kSuspicious && !uplink_) {
    return "no command arrives, and the robot's messages are " + text(unanswered_) +
           (unanswered_.us > 0 ? " later" : " earlier") + " than before: do the clocks differ?";
  }
  return {};
}

}  // namespace foresight
