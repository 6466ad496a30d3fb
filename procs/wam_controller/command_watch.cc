#include "procs/wam_controller/command_watch.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace foresight {
namespace {

constexpr int64_t kTooMany = 3;  // in a second; fewer may be late ones of an engage that has ended
constexpr uint64_t kLargestSeqStep = 10;  // over which a sender's period tells where a stamp lies
constexpr Duration kClockTolerance = milliseconds(10);
constexpr Duration kStep = milliseconds(100);
constexpr int kConfirmations = 3;  // commands
constexpr Duration kStepIsSaidFor = seconds(10);
constexpr Duration kSettling = seconds(2);          // longer than commands are under way
constexpr int64_t kFarAway_us = 1'000'000'000'000;  // absurd stamps must not overflow

constexpr std::array<const char*, kCommandVerdicts> kWhyDropped{
    "",
    "older than one that is already here",
    "too old, or out of a stall",
    "with another number of joints, or with what is no number",
    "stamped in the future",
    "of another session than the driver's",
    "engaged before the arm was ready: let go and press again"};

Time within_reach(Time arrival, Time stamp) {
  return {std::clamp(stamp.us, arrival.us - kFarAway_us, arrival.us + kFarAway_us)};
}

Duration magnitude(Duration d) { return std::max(d, d * -1); }

int64_t rounded_ms(Duration d) { return std::llround(d.seconds() * 100) * 10; }

}  // namespace

void CommandWatch::on_command(Time arrival, const JointCommand& command, CommandVerdict verdict) {
  age_ = arrival - within_reach(arrival, command.time);
  second_.longest_age = second_.commands == 0 ? age_ : std::max(second_.longest_age, age_);
  ++second_.commands;
  look_for_step(arrival, command);
  if (!command.is_engaged) return;
  if (verdict == CommandVerdict::kAccepted) ++second_.followed;
  if (verdict != CommandVerdict::kAccepted) ++second_.dropped[static_cast<size_t>(verdict)];
  if (verdict == CommandVerdict::kOfOthers) second_.other_session = command.session;
}

void CommandWatch::on_clock_change(Time now) {
  has_settled_ = false;
  settles_at_ = now + kSettling;
  suspected_step_ = {};
  last_ = {};
  least_age_ = {};
}

// A stall of the device makes stamps and arrivals jump, one of the link arrivals alone, a clock
// that is set stamps alone, and for good: one forged stamp is none. When device and link stand
// still at once, stamps jump alone too, but afterwards commands are as old as they were before.
void CommandWatch::look_for_step(Time arrival, const JointCommand& command) {
  has_settled_ = has_settled_ || arrival >= settles_at_ || settles_at_ - arrival > kSettling;
  if (!has_settled_) return;
  const Time stamp = within_reach(arrival, command.time);
  const uint64_t step = static_cast<uint64_t>(command.seq) - static_cast<uint64_t>(last_.seq);
  const bool goes_on = last_.is_known && last_.session == command.session &&
                       last_.seq < command.seq && step <= kLargestSeqStep;
  Duration period = goes_on ? last_.period : Duration{};
  if (goes_on) {
    const auto count = static_cast<int64_t>(step);
    const Duration passed = stamp - last_.stamp;
    const Duration jump = passed - period * count;
    const Duration age_change = (arrival - last_.arrival) - passed;
    if (period.us == 0) {
      if (passed.us > 0 && passed < seconds(1) * count) period = {passed.us / count};
    } else if (magnitude(jump) > kStep && magnitude(age_change) > kStep) {
      suspect_step(jump);
    }
    least_age_since_step_ = std::min(least_age_since_step_, arrival - stamp);
    if (suspected_step_.us != 0 && confirmations_++ == kConfirmations) {
      if (ages_confirm_step()) {
        clock_step_ = suspected_step_;
        clock_stepped_at_ = arrival;
      }
      suspected_step_ = {};
    }
  } else {
    suspected_step_ = {};
    least_age_ = {};
  }
  note_age(arrival, arrival - stamp);
  last_ = {true, command.session, command.seq, stamp, arrival, period};
}

void CommandWatch::suspect_step(Duration jump) {
  const bool is_back = magnitude(suspected_step_ + jump) < kStep;
  if (suspected_step_.us == 0) age_before_step_ = usual_age();
  suspected_step_ = is_back ? Duration{} : jump;
  least_age_since_step_ = kNoAge;
  confirmations_ = 0;
}

bool CommandWatch::ages_confirm_step() const {
  if (age_before_step_ == kNoAge) return false;
  return magnitude(least_age_since_step_ - age_before_step_ + suspected_step_) < kStep;
}

void CommandWatch::note_age(Time arrival, Duration age) {
  const Duration passed = arrival - least_age_.second_began;
  if (passed < Duration{} || passed >= seconds(1)) {
    least_age_ = {arrival, least_age_.of_this, kNoAge};
  }
  least_age_.of_this = std::min(least_age_.of_this, age);
}

void CommandWatch::on_time(Time now, int64_t malformed) {
  const Duration passed = now - second_began_;
  if (passed >= Duration{} && passed < seconds(1)) return;
  second_.malformed = malformed - malformed_;
  malformed_ = malformed;
  const bool is_ahead = second_.commands >= kTooMany && second_.longest_age < kClockTolerance * -1;
  clock_ahead_ = is_ahead ? second_.longest_age * -1 : Duration{};
  complaint_ = describe(now);
  second_ = {};
  second_began_ = now;
}

std::string CommandWatch::describe(Time now) const {
  std::ostringstream text;
  const auto next = [&text]() -> std::ostream& { return text << (text.tellp() > 0 ? "; " : ""); };
  int64_t dropped = second_.malformed;
  for (const int64_t count : second_.dropped) dropped += count;
  if (second_.followed == 0 && dropped >= kTooMany) next() << describe_drops();
  const int64_t of_others = second_.dropped[static_cast<size_t>(CommandVerdict::kOfOthers)];
  if (of_others >= kTooMany) {
    next() << "a second operator commands: session " << second_.other_session << ", " << of_others
           << " dropped in a second";
  }
  if (clock_ahead_.us > 0) {
    next() << "the operator's clock is at least " << rounded_ms(clock_ahead_)
           << " ms ahead of this one";
  }
  if (clock_step_.us != 0 && now - clock_stepped_at_ < kStepIsSaidFor) {
    next() << "the operator's clock was set by " << rounded_ms(clock_step_) << " ms";
  }
  return text.str();
}

std::string CommandWatch::describe_drops() const {
  std::ostringstream text;
  text << "every command is dropped: in a second";
  const char* separator = " ";
  for (size_t i = 0; i < second_.dropped.size(); ++i) {
    if (second_.dropped[i] == 0) continue;
    text << separator << second_.dropped[i] << " " << kWhyDropped[i];
    separator = ", ";
  }
  if (second_.malformed > 0) {
    text << separator << second_.malformed << " damaged, or with what is no number";
  }
  return text.str();
}

}  // namespace foresight
