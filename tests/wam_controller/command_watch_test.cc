// The watch over commands by itself: whether a clock was set, told from their stamps and arrivals.
#include "procs/wam_controller/command_watch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace foresight {
namespace {

constexpr Duration kPeriod = milliseconds(10), kWay = milliseconds(150);

class ASetClock : public testing::Test {
 protected:
  /// A command that leaves now by the true time, and is stamped by the operator's clock.
  void command(Duration late = {}) {
    const Time arrival = std::max(last_arrival_, now_ + kWay + late);  // a FIFO
    last_arrival_ = arrival;
    const JointCommand command{now_ + ahead_, 7, ++seq_, true, JointVector::Zero(4)};
    watch_.on_command(arrival, command, CommandVerdict::kAccepted);
    watch_.on_time(arrival, 0);
    now_ = now_ + kPeriod;
  }
  void commands(Duration duration, Duration late = {}) {
    for (const Time end = now_ + duration; now_ < end;) command(late);
  }
  bool is_said() const { return watch_.complaint().find("clock was set") != std::string::npos; }

  CommandWatch watch_;
  Time now_{seconds(1000).us}, last_arrival_;
  Duration ahead_;
  int64_t seq_ = 0;
};

TEST_F(ASetClock, IsSaidWhicheverWay) {
  for (const Duration step : {milliseconds(150), milliseconds(-150), milliseconds(900)}) {
    SCOPED_TRACE(step.us);
    commands(seconds(3));
    ASSERT_FALSE(is_said());
    ahead_ = ahead_ + step;
    commands(seconds(3));
    EXPECT_TRUE(is_said()) << watch_.complaint();
    commands(seconds(12));
  }
}

// The host of all was busy: link forwards late what it had, and the device goes on late.
TEST_F(ASetClock, IsNotWhatDeviceAndLinkDoTogether) {
  for (const Duration stall : {milliseconds(120), milliseconds(240), milliseconds(600)}) {
    SCOPED_TRACE(stall.us);
    commands(seconds(3));
    command(stall);  // held by link
    now_ = now_ + stall;
    commands(seconds(3));
    EXPECT_FALSE(is_said()) << watch_.complaint();
  }
}

TEST_F(ASetClock, IsNotWhatABusyHostDoes) {
  std::mt19937 random(1);
  const auto chance = [&random](int of) { return static_cast<int>(random() % of) == 0; };
  const auto up_to_ms = [&random](unsigned n) { return milliseconds(random() % n); };
  for (int i = 0; i < 20'000; ++i) {
    if (chance(50)) now_ = now_ + up_to_ms(400);
    command(chance(20) ? up_to_ms(400) : Duration{});
    ASSERT_FALSE(is_said()) << "command " << i << ": " << watch_.complaint();
  }
}

// Commands at 30 Hz that travel for 150 ms.
class CommandWatchTest : public testing::Test {
 protected:
  void command(int count, Duration operators_clock_ahead) {
    for (int i = 0; i < count; ++i) {
      now_ = now_ + milliseconds(33);
      JointCommand command;
      command.time = now_ - milliseconds(150) + operators_clock_ahead;
      command.session = 1;
      command.seq = ++seq_;
      watch_.on_command(now_, command, CommandVerdict::kAccepted);
      watch_.on_time(now_, 0);
    }
  }
  CommandWatch watch_;
  Time now_{1'000'000'000};
  int64_t seq_ = 0;
};

TEST_F(CommandWatchTest, SaysThatTheOperatorsClockWasSet) {
  command(60, {});
  EXPECT_EQ(watch_.complaint(), "");
  command(60, milliseconds(-1000));
  EXPECT_EQ(watch_.complaint(), "the operator's clock was set by -1000 ms");
}

// A simulated world that begins anew sets all clocks, one after the other.
TEST_F(CommandWatchTest, AnotherWorldIsNoClockThatWasSet) {
  for (const int64_t jump_ms : {1000, -1000}) {
    command(60, {});
    now_ = now_ + milliseconds(jump_ms);
    watch_.on_clock_change(now_);
    command(5, milliseconds(-jump_ms));  // under way
    for (int i = 0; i < 60; ++i) {
      command(1, {});
      EXPECT_EQ(watch_.complaint().find("was set"), std::string::npos) << watch_.complaint();
    }
  }
  command(60, milliseconds(-500));
  EXPECT_EQ(watch_.complaint(), "the operator's clock was set by -500 ms") << "later";
}

}  // namespace
}  // namespace foresight
