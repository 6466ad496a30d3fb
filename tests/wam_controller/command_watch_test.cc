// What the controller says about the clocks of those who command it.
#include "procs/wam_controller/command_watch.h"

#include <gtest/gtest.h>

namespace foresight {
namespace {

// Commands at 30 Hz that travel for 150 ms.
class CommandWatchTest : public testing::Test {
 protected:
  void command(int count, Duration operators_clock_ahead) {
    for (int i = 0; i < count; ++i) {
      now_ = now_ + milliseconds(33);
      ArmCommand command;
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
