// What a clock that is set while omni runs must not do.
#include <gtest/gtest.h>

#include "procs/omni/command_session.h"
#include "procs/omni/key_decoder.h"
#include "procs/omni/steady_time.h"

namespace foresight {
namespace {

TEST(SteadyTime, IsTheClockUntilThatGoesBack) {
  SteadyTime steady;
  EXPECT_EQ(steady.at(Time{5'000'000}), Time{5'000'000});
  EXPECT_EQ(steady.at(Time{6'000'000}), Time{6'000'000});
  EXPECT_EQ(steady.at(Time{1'000'000}), Time{6'000'000});
  EXPECT_EQ(steady.at(Time{1'500'000}), Time{6'500'000});
}

TEST(SteadyTime, AKeyIsNotHeldForAsLongAsTheClockWasSetBack) {
  SteadyTime steady;
  KeyDecoder keys(0.2);
  keys.feed('a', steady.at(Time{10'000'000}));
  EXPECT_EQ(keys.axes(steady.at(Time{10'100'000}))[0], 1);
  steady.at(Time{7'000'000});
  EXPECT_EQ(keys.axes(steady.at(Time{7'150'000}))[0], 0);
}

TEST(CommandSession, CountsWithinTheSessionThatBeganFirst) {
  CommandSession session;
  session.begin(Time{5'000'000});
  for (int64_t i = 1; i <= 100; ++i) {
    EXPECT_FALSE(session.update(Time{5'000'000 + 33'333 * i}));
    EXPECT_EQ(session.session(), 5'000'000);
    EXPECT_EQ(session.next_seq(), i);
  }
}

// omni killed while the simulated world lags: it starts by the wall clock, before the first CLOCK.
TEST(CommandSession, NeverLiesInTheFuture) {
  CommandSession session;
  session.begin(Time{60'000'000});
  EXPECT_FALSE(session.update(Time{60'010'000}));
  session.next_seq();
  EXPECT_TRUE(session.update(Time{59'900'000})) << "the world's time";
  EXPECT_EQ(session.session(), 59'900'000);
  EXPECT_EQ(session.next_seq(), 1);
}

TEST(CommandSession, BeginsAnewWhenTheClockIsSetBack) {
  CommandSession session;
  session.begin(Time{10'000'000});
  EXPECT_FALSE(session.update(Time{60'000'000}));
  EXPECT_FALSE(session.update(Time{59'500'000})) << "jitter";
  EXPECT_TRUE(session.update(Time{57'000'000}));
  EXPECT_EQ(session.session(), 57'000'000);
}

}  // namespace
}  // namespace foresight
