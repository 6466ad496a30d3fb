#include "common/log_timeline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

namespace foresight {
namespace {

constexpr Time kStart{1'700'000'000'000'000};

/// `count` events, 10 ms apart.
std::vector<Time> rising(int count) {
  std::vector<Time> stamps;
  for (int i = 0; i < count; ++i) stamps.push_back(kStart + milliseconds(10) * i);
  return stamps;
}

TEST(LogTimeline, LeavesARecordersStampsAlone) {
  const auto stamps = rising(500);
  const LogTimeline timeline = make_timeline(stamps);
  EXPECT_EQ(timeline.times, stamps);
  EXPECT_EQ(timeline.remark(), "");
  EXPECT_FALSE(timeline.is_out_of_order());
  EXPECT_TRUE(make_timeline({}).times.empty());
}

TEST(LogTimeline, ASmallDisorderIsCountedAndKept) {
  auto stamps = rising(500);
  std::swap(stamps[100], stamps[101]);
  const LogTimeline timeline = make_timeline(stamps);
  EXPECT_EQ(timeline.times, stamps);
  EXPECT_EQ(timeline.late, 1);
  EXPECT_NE(timeline.remark().find("1 of 500 events"), std::string::npos) << timeline.remark();
  EXPECT_FALSE(timeline.is_out_of_order());
}

TEST(LogTimeline, AShuffledLogIsSorted) {
  const auto stamps = rising(2000);
  auto shuffled = stamps;
  std::mt19937 random(3);
  for (size_t i = shuffled.size() - 1; i > 0; --i) {
    std::swap(shuffled[i], shuffled[random() % (i + 1)]);
  }
  const LogTimeline timeline = make_timeline(shuffled);
  EXPECT_EQ(timeline.times, stamps);
  for (size_t i = 0; i < stamps.size(); ++i) EXPECT_EQ(shuffled[timeline.order[i]], stamps[i]);
  EXPECT_TRUE(timeline.is_out_of_order());
  EXPECT_NE(timeline.remark().find("shuffled"), std::string::npos);
}

TEST(LogTimeline, AClockStepOfAnHourTakesNoTime) {
  for (const double step_s : {-3600.0, -7200.0, 7200.0}) {
    auto stamps = rising(1000);
    for (size_t i = 700; i < stamps.size(); ++i) stamps[i] = stamps[i] + seconds(step_s);
    const LogTimeline timeline = make_timeline(stamps);
    std::vector<size_t> order(1000);
    std::iota(order.begin(), order.end(), size_t{0});
    EXPECT_EQ(timeline.order, order);
    EXPECT_EQ(timeline.times[0], stamps[0]) << "the longest stretch keeps its stamps";
    EXPECT_EQ((timeline.times[999] - timeline.times[0]).us, 9'980'000);
    EXPECT_TRUE(std::is_sorted(timeline.times.begin(), timeline.times.end()));
    EXPECT_NE(timeline.remark(), "");
    EXPECT_EQ(timeline.is_out_of_order(), step_s < 0) << "forward may be a long silence";
  }
}

TEST(LogTimeline, OneAbsurdStampTakesNoTime) {
  for (const size_t where : {0u, 1u, 500u, 999u}) {
    for (const Time absurd : {Time{0}, Time{1ll << 60}}) {
      auto stamps = rising(1000);
      stamps[where] = absurd;
      const LogTimeline timeline = make_timeline(stamps);
      EXPECT_LT((timeline.times.back() - timeline.times.front()).us, 10'000'000);
      const size_t other = where == 999 ? 0 : 999;
      EXPECT_LT(std::abs((timeline.times[other] - stamps[other]).us), 20'000'000);
    }
  }
}

}  // namespace
}  // namespace foresight
