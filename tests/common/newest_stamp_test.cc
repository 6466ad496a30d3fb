#include "common/newest_stamp.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "common/persistent_value.h"

namespace foresight {
namespace {

constexpr Time kStart{1'700'000'000'000'000};
constexpr Duration kPeriod = milliseconds(33);
constexpr Duration kLatency = milliseconds(150);

// A stream at 30 Hz, as late as a link makes it.
class Stream {
 public:
  StampVerdict next() {
    now_ = now_ + kPeriod;
    return newest_.judge(now_, now_ - kLatency);
  }
  void run(int count) {
    for (int i = 0; i < count; ++i) EXPECT_EQ(next(), StampVerdict::kNewer) << i;
  }
  StampVerdict forge(Time stamp) { return newest_.judge(now_, stamp); }
  // How long after the last forged message the stream counts again.
  Duration recovery() {
    const Time forged = now_;
    while (!is_taken(next()) && now_ - forged < seconds(60)) {
    }
    return now_ - forged;
  }
  Time now_ = kStart;
  NewestStamp newest_;
};

TEST(NewestStamp, TakesAStreamInOrderOnly) {
  Stream stream;
  stream.run(10);
  EXPECT_EQ(stream.forge(stream.now_ - kLatency), StampVerdict::kRepeated);
  EXPECT_EQ(stream.forge(stream.now_ - kLatency - milliseconds(20)), StampVerdict::kOld);
  stream.run(10);
}

TEST(NewestStamp, OneAbsurdStampIsRefusedAndTheStreamGoesOn) {
  const int64_t largest = std::numeric_limits<int64_t>::max();
  const int64_t smallest = std::numeric_limits<int64_t>::min();
  for (const int64_t us : {largest, smallest, int64_t{0}, int64_t{-1}, int64_t{1} << 53,
                           int64_t{9'000'000'000'000'000'000}}) {
    Stream stream;
    stream.run(10);
    EXPECT_EQ(stream.forge({us}), StampVerdict::kAbsurd) << us;
    stream.run(10);
  }
  Stream stream;
  stream.run(10);
  EXPECT_EQ(stream.forge(kStart + seconds(3600)), StampVerdict::kFuture);
  stream.run(10);
}

// Whatever was forged before, however often, and also as the first message of all.
TEST(NewestStamp, TheStreamThatKeepsComingWins) {
  for (const double ahead_s : {0.9, 5.0, 3600.0, 1e8, -3600.0, -1e8}) {
    for (const int forged : {1, 3, 100}) {
      for (const int before : {0, 10}) {
        Stream stream;
        stream.run(before);
        for (int i = 0; i < forged; ++i) {
          stream.now_ = stream.now_ + kPeriod;
          static_cast<void>(stream.forge(stream.now_ + seconds(ahead_s)));
        }
        EXPECT_LE(stream.recovery(), milliseconds(400)) << ahead_s << " s, " << forged;
        stream.run(10);
      }
    }
  }
}

TEST(NewestStamp, AClockThatIsSetCostsAMoment) {
  for (const double step_s : {-3.0, 3.0, -0.3, 0.3, -3600.0}) {
    Stream stream;
    stream.run(10);
    Time stamp = stream.now_ - kLatency;
    int taken = 0;
    for (int i = 0; i < 60; ++i) {
      stamp = stamp + kPeriod;
      stream.now_ = stream.now_ + kPeriod;
      if (is_taken(stream.newest_.judge(stream.now_ + seconds(step_s), stamp))) ++taken;
    }
    EXPECT_GE(taken, 51) << step_s;
  }
}

TEST(NewestStamp, ARecordingAtTenTimesTheSpeedIsHeard) {
  NewestStamp newest;
  for (int i = 0; i < 1000; ++i) {
    EXPECT_EQ(newest.judge(kStart + milliseconds(3) * i, kStart + milliseconds(33) * i),
              StampVerdict::kNewer);
  }
}

TEST(NewestStamp, ReorderingIsNoRestart) {
  std::mt19937 random(3);
  Stream stream;
  stream.run(3);
  for (int i = 0; i < 1000; ++i) {
    stream.run(1);
    const int late = static_cast<int>(random() % 4);
    for (int k = late; k > 0; --k) {
      EXPECT_EQ(stream.forge(stream.now_ - kLatency - milliseconds(5) * k), StampVerdict::kOld);
    }
  }
}

TEST(NewestStamp, AStalledStreamGoesOnWhereverItsBacklogEnds) {
  Stream stream;
  stream.run(10);
  const Time stalled = stream.now_;
  stream.now_ = stalled + seconds(5);
  EXPECT_EQ(stream.forge(stalled), StampVerdict::kNewer);
  EXPECT_EQ(stream.forge(stalled + seconds(4)), StampVerdict::kNewer);
  stream.run(10);
}

TEST(NewestStamp, SlowStreamsNeedTwoMessages) {
  NewestStamp newest({.patience = 2});
  Time now = kStart;
  EXPECT_EQ(newest.judge(now, now + milliseconds(900)), StampVerdict::kNewer);
  EXPECT_EQ(newest.judge(now, now), StampVerdict::kOld);
  now = now + milliseconds(800);
  EXPECT_EQ(newest.judge(now, now), StampVerdict::kRestarted);
}

TEST(PersistentValue, AChangeMustPersist) {
  PersistentValue<int> value(3);
  EXPECT_TRUE(value.offer(5)) << "the first counts at once";
  EXPECT_FALSE(value.offer(7));
  EXPECT_FALSE(value.offer(7));
  EXPECT_TRUE(value.offer(5)) << "contradicted";
  EXPECT_FALSE(value.offer(7));
  EXPECT_FALSE(value.offer(8)) << "another one";
  EXPECT_FALSE(value.offer(7));
  EXPECT_FALSE(value.offer(7));
  EXPECT_EQ(value.value(), 5);
  EXPECT_TRUE(value.offer(7));
  EXPECT_EQ(value.value(), 7);
}

}  // namespace
}  // namespace foresight
