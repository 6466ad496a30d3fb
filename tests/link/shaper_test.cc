#include "procs/link/shaper.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace foresight {
namespace {

constexpr Time kStart{1'000'000'000};

struct Departure {
  Time arrival;
  std::optional<ShaperPlan> plan;
  ShaperDrop drop;
};

// `count` messages of `bytes`, one every `period`.
std::vector<Departure> send(const ShaperOptions& options, uint32_t seed, int count, Duration period,
                            size_t bytes = 1000) {
  Shaper shaper(options, seed);
  std::vector<Departure> out;
  for (int i = 0; i < count; ++i) {
    const Time arrival = kStart + period * i;
    const auto plan = shaper.admit(arrival, bytes);
    out.push_back({arrival, plan, shaper.last_drop()});
  }
  return out;
}

TEST(Shaper, DelaysEveryMessageByTheSameTime) {
  for (const Departure& d : send({.delay_s = 0.15}, 1, 1000, milliseconds(10))) {
    ASSERT_TRUE(d.plan);
    EXPECT_EQ(d.plan->departure - d.arrival, milliseconds(150));
    EXPECT_FALSE(d.plan->reordered);
  }
}

TEST(Shaper, WithoutOptionsPassesAtOnce) {
  for (const Departure& d : send({}, 1, 100, milliseconds(1))) {
    EXPECT_EQ(d.plan->departure, d.arrival);
  }
}

// Messages so far apart that keeping their order changes no delay.
TEST(Shaper, JitterIsUniformWithinItsBounds) {
  const auto sent = send({.delay_s = 0.15, .jitter_s = 0.05}, 1, 20'000, seconds(1));
  double sum_s = 0, squares = 0;
  for (const Departure& d : sent) {
    const double delay_s = (d.plan->departure - d.arrival).seconds();
    EXPECT_GE(delay_s, 0.1 - 1e-6);
    EXPECT_LE(delay_s, 0.2 + 1e-6);
    sum_s += delay_s;
    squares += (delay_s - 0.15) * (delay_s - 0.15);
  }
  EXPECT_NEAR(sum_s / 20'000, 0.15, 0.001);
  EXPECT_NEAR(std::sqrt(squares / 20'000), 0.05 / std::sqrt(3.0), 0.001);
}

TEST(Shaper, JitterNeverMakesADelayNegative) {
  for (const Departure& d : send({.delay_s = 0.01, .jitter_s = 0.1}, 1, 1000, seconds(1))) {
    EXPECT_GE(d.plan->departure, d.arrival);
  }
}

TEST(Shaper, KeepsTheOrderInSpiteOfJitter) {
  Time last{0};
  for (const Departure& d : send({.delay_s = 0.15, .jitter_s = 0.1}, 1, 10'000, milliseconds(3))) {
    EXPECT_GE(d.plan->departure, last);
    last = d.plan->departure;
  }
}

TEST(Shaper, LosesTheShareThatIsAsked) {
  int lost = 0;
  for (const Departure& d : send({.loss = 0.1}, 1, 50'000, milliseconds(1))) {
    lost += d.plan ? 0 : 1;
    EXPECT_EQ(d.drop, d.plan ? ShaperDrop::kNone : ShaperDrop::kLost);
  }
  EXPECT_NEAR(lost / 50'000.0, 0.1, 0.005);
}

TEST(Shaper, LosesAllOrNothingAtTheLimits) {
  for (const Departure& d : send({.loss = 1}, 1, 1000, milliseconds(1))) EXPECT_FALSE(d.plan);
  for (const Departure& d : send({.loss = 0}, 1, 1000, milliseconds(1))) EXPECT_TRUE(d.plan);
}

// 1000 bytes each 10 ms is 100 kB/s; the bottleneck lets half of it pass.
TEST(Shaper, LimitsTheRateAndDropsWhatTheQueueCannotHold) {
  const auto sent = send({.delay_s = 0.1, .rate_bytes_per_s = 50'000, .queue_s = 0.5}, 1, 10'000,
                         milliseconds(10));
  int passed = 0;
  Time last{0};
  for (const Departure& d : sent) {
    if (!d.plan) {
      EXPECT_EQ(d.drop, ShaperDrop::kQueueFull);
      continue;
    }
    ++passed;
    EXPECT_GE((d.plan->departure - last).seconds(), 0.02 - 1e-6) << "one per 20 ms at most";
    EXPECT_LE((d.plan->departure - d.arrival).seconds(), 0.1 + 0.5 + 0.02 + 1e-6);
    last = d.plan->departure;
  }
  EXPECT_NEAR(passed, 5000, 30);
}

TEST(Shaper, BelowItsRateOnlyAddsTheTimeOfTransmission) {
  for (const Departure& d :
       send({.delay_s = 0.1, .rate_bytes_per_s = 1e6}, 1, 100, milliseconds(10))) {
    EXPECT_EQ(d.plan->departure - d.arrival, milliseconds(101));
  }
}

TEST(Shaper, LossHappensBehindTheBottleneck) {
  const auto sent =
      send({.loss = 0.5, .rate_bytes_per_s = 50'000, .queue_s = 0.1}, 1, 10'000, milliseconds(10));
  int passed = 0;
  for (const Departure& d : sent) passed += d.plan ? 1 : 0;
  EXPECT_NEAR(passed, 2500, 150) << "half of what the bottleneck lets pass";
}

TEST(Shaper, ReordersTheShareThatIsAskedAndKeepsTheRestInOrder) {
  const auto sent = send({.delay_s = 0.1, .reorder = 0.05}, 1, 20'000, milliseconds(10));
  int reordered = 0;
  Time last{0};
  for (size_t i = 0; i + 10 < sent.size(); ++i) {
    const ShaperPlan& plan = *sent[i].plan;
    if (!plan.reordered) {
      EXPECT_GE(plan.departure, last);
      last = plan.departure;
      continue;
    }
    ++reordered;
    int overtaken_by = 0;
    for (size_t k = i + 1; k < i + 10; ++k) {
      overtaken_by += sent[k].plan->departure < plan.departure ? 1 : 0;
    }
    EXPECT_GT(overtaken_by, 0);
  }
  EXPECT_NEAR(reordered / 20'000.0, 0.05, 0.005);
}

TEST(Shaper, TheSameSeedGivesTheSamePlan) {
  const ShaperOptions options{
      .delay_s = 0.1, .jitter_s = 0.05, .loss = 0.2, .reorder = 0.1, .rate_bytes_per_s = 2e5};
  const auto plans = [&](uint32_t seed) {
    std::vector<int64_t> times;
    for (const Departure& d : send(options, seed, 1000, milliseconds(5))) {
      times.push_back(d.plan ? d.plan->departure.us : -1);
    }
    return times;
  };
  EXPECT_EQ(plans(3), plans(3));
  EXPECT_NE(plans(3), plans(4));
}

TEST(Shaper, OneOptionDoesNotChangeTheDrawsOfAnother) {
  const auto lost = [](const ShaperOptions& options) {
    std::vector<bool> is_lost;
    for (const Departure& d : send(options, 5, 1000, seconds(1))) is_lost.push_back(!d.plan);
    return is_lost;
  };
  EXPECT_EQ(lost({.loss = 0.3}), lost({.delay_s = 1, .jitter_s = 0.5, .loss = 0.3}));
  EXPECT_EQ(lost({.loss = 0.3}), lost({.loss = 0.3, .reorder = 0.5}));
}

}  // namespace
}  // namespace foresight
