#include "common/snapshot_gate.h"

#include <gtest/gtest.h>

namespace foresight {
namespace {

// How many answers so many requests get.
int answers(int requests, Duration between) {
  SnapshotGate gate;
  int count = 0;
  constexpr Time kNever{int64_t{1} << 60};
  Time due = kNever;
  const auto answer_if_due = [&](Time now) {
    if (due > now) return;
    gate.answered(now);
    due = kNever;
    ++count;
  };
  for (int i = 0; i < requests; ++i) {
    const Time now = Time{1'000} + between * i;
    answer_if_due(now);
    if (const auto asked = gate.request(now)) due = *asked;
    answer_if_due(now);
  }
  return count;
}

TEST(SnapshotGate, AnswersTheFirstRequestAtOnce) {
  SnapshotGate gate;
  EXPECT_EQ(gate.request({5}), Time{5});
}

TEST(SnapshotGate, OneAnswerInHalfASecondServesEverybody) {
  EXPECT_EQ(answers(4000, microseconds(1)), 1);
  EXPECT_EQ(answers(4001, milliseconds(1)), 9);
}

TEST(SnapshotGate, WhoAsksTooSoonIsServedLater) {
  SnapshotGate gate;
  ASSERT_TRUE(gate.request({0}));
  gate.answered({0});
  EXPECT_EQ(gate.request({200'000}), Time{500'000});
  EXPECT_FALSE(gate.request({400'000})) << "the same answer serves this one";
  gate.answered({500'000});
  EXPECT_EQ(gate.request({5'000'000}), Time{5'000'000});
}

TEST(SnapshotGate, AClockThatIsSetBackSilencesNobody) {
  SnapshotGate gate;
  ASSERT_TRUE(gate.request(Time{} + seconds(3600)));
  gate.answered(Time{} + seconds(3600));
  EXPECT_EQ(gate.request({7}), Time{7});
}

}  // namespace
}  // namespace foresight
