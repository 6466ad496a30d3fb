// When a world of its own pace goes on.
#include "sim/robot/pacer.h"

#include <gtest/gtest.h>

namespace foresight::sim {
namespace {

constexpr Duration kTick = milliseconds(2);

class PacerTest : public testing::Test {
 protected:
  // Ticks that are taken while `wall` passes in steps of 1 ms.
  int run(Duration wall, bool answering) {
    int ticks = 0;
    for (Duration t; t < wall; t = t + milliseconds(1)) {
      now_ = now_ + milliseconds(1);
      while (pacer_.may_tick(now_, false)) {
        pacer_.on_tick(now_);
        ++ticks;
        if (answering) pacer_.on_torques(true);
      }
    }
    return ticks;
  }
  void begin(double speed) {
    pacer_ = Pacer(speed, kTick);
    static_cast<void>(pacer_.may_tick(now_, false));
  }
  Time now_{5'000'000};
  Pacer pacer_{1, kTick};
};

TEST_F(PacerTest, KeepsToTheSpeed) {
  for (const double speed : {0.1, 0.5, 1.0, 3.0}) {
    begin(speed);
    EXPECT_NEAR(run(seconds(2), true), speed * 1000, 2) << speed;
  }
}

TEST_F(PacerTest, WaitsForAnAnswerButNotForEver) {
  begin(1);
  run(milliseconds(100), true);
  const int ticks = run(milliseconds(200), false);
  EXPECT_NEAR(ticks, 10, 2);                  // one each 20 ms
  EXPECT_EQ(pacer_.unanswered(), ticks - 1);  // the last still waits
}

TEST_F(PacerTest, GoesOnWithoutAControllerThatIsNotThere) {
  begin(1);
  EXPECT_NEAR(run(seconds(1), false), 500, 2);
  EXPECT_EQ(pacer_.unanswered(), 0) << "none has ever answered";
}

TEST_F(PacerTest, StopsWaitingForAControllerThatDied) {
  begin(1);
  run(milliseconds(100), true);
  run(milliseconds(600), false);
  EXPECT_NEAR(run(seconds(1), false), 500, 5);
}

TEST_F(PacerTest, BeginsToWaitWhenAControllerAppearsHoweverLate) {
  begin(1);
  run(milliseconds(100), false);
  pacer_.on_torques(false);
  EXPECT_NEAR(run(milliseconds(200), false), 10, 2);
}

TEST_F(PacerTest, WaitsForAPicture) {
  begin(1);
  now_ = now_ + milliseconds(10);
  EXPECT_FALSE(pacer_.may_tick(now_, true));
  EXPECT_TRUE(pacer_.may_tick(now_, false));
}

TEST_F(PacerTest, DoesNotMakeUpForALongWait) {
  begin(1);
  now_ = now_ + seconds(10);
  EXPECT_LE(run(milliseconds(1), true), 10);
}

TEST_F(PacerTest, AWallClockThatJumpsBackOnlyCostsTime) {
  begin(1);
  run(milliseconds(100), true);
  now_ = now_ - seconds(3600);
  EXPECT_LE(run(milliseconds(10), true), 15);
  EXPECT_NEAR(run(seconds(1), true), 500, 10);
}

}  // namespace
}  // namespace foresight::sim
