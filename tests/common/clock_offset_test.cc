#include "common/clock_offset.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace foresight {
namespace {

// Two sites with a clock each and a link between them: commands at 30 Hz there, states at 100 Hz
// back. Time goes on in true time; each site stamps with its own clock.
class TwoSites {
 public:
  double up_s = 0.2, down_s = 0.3, jitter_s = 0;
  double operator_offset_s = 0, robot_offset_s = 0;
  bool is_command_refused = false;
  std::function<void()> after_sample = [] {};

  void run(ClockOffset* clocks, double span_s) {
    const double end_s = now_s_ + span_s;
    for (; now_s_ < end_s; now_s_ += 0.01, ++step_) {
      if (step_ % 3 == 0 && !is_command_refused) {
        commands_.push_back({now_s_ + up_s + jitter(), stamp(operator_offset_s), {}});
      }
      for (Mail& mail : commands_) {
        if (mail.due_s > now_s_) continue;
        command_ = mail.first;
        arrival_ = stamp(robot_offset_s);
        mail.due_s = 1e9;
      }
      states_.push_back({now_s_ + down_s + jitter(), stamp(robot_offset_s), {command_, arrival_}});
      for (Mail& mail : states_) {
        if (mail.due_s > now_s_) continue;
        clocks->add({stamp(operator_offset_s), mail.first, mail.rest.command, mail.rest.arrival});
        mail.due_s = 1e9;
        after_sample();
      }
    }
  }

 private:
  struct Rest {
    Time command, arrival;
  };
  struct Mail {
    double due_s;
    Time first;
    Rest rest;
  };
  Time stamp(double offset_s) const { return Time{0} + seconds(1000 + now_s_ + offset_s); }
  double jitter() { return jitter_s * static_cast<double>(random_()) / 4294967296.0; }

  std::mt19937 random_{7};
  double now_s_ = 0;
  int step_ = 0;
  std::vector<Mail> commands_, states_;
  Time command_, arrival_;
};

double ms(std::optional<Duration> d) { return d ? 1e3 * d->seconds() : -1e9; }

TEST(ClockOffset, SaysTheLatenciesOfClocksThatAgree) {
  TwoSites sites;
  ClockOffset clocks;
  EXPECT_FALSE(clocks.downlink());
  EXPECT_EQ(clocks.complaint(), "");
  sites.run(&clocks, 5);
  EXPECT_NEAR(ms(clocks.uplink()), 200, 11);
  EXPECT_NEAR(ms(clocks.downlink()), 300, 11);
  EXPECT_NEAR(ms(clocks.round_trip()), 500, 21);
  EXPECT_LE(std::abs(ms(clocks.offset())), 250) << "half a round trip at most";
  EXPECT_TRUE(clocks.agree()) << clocks.complaint();
}

TEST(ClockOffset, NothingIsSaidOfJitterOrOfDelaysThatChange) {
  TwoSites sites;
  sites.jitter_s = 0.1;
  ClockOffset clocks;
  std::string complaint;
  sites.after_sample = [&] { complaint += clocks.complaint(); };
  sites.run(&clocks, 20);
  sites.up_s = 0.8;
  sites.run(&clocks, 20);
  sites.down_s = 0.05;
  sites.run(&clocks, 20);
  sites.up_s = sites.down_s = 0.6;
  sites.run(&clocks, 20);
  EXPECT_EQ(complaint, "");
}

TEST(ClockOffset, ALatencyBelowZeroIsImpossible) {
  for (const double offset_s : {1.0, -1.0, 20.0, -20.0}) {
    TwoSites sites;
    sites.robot_offset_s = offset_s;
    ClockOffset clocks;
    sites.run(&clocks, 1);
    EXPECT_TRUE(clocks.is_impossible());
    EXPECT_NEAR(ms(clocks.offset()), 1e3 * offset_s, 250) << "half a round trip";
    EXPECT_NE(clocks.complaint().find(offset_s > 0 ? " ms ahead" : " ms behind"), std::string::npos)
        << clocks.complaint();
  }
}

TEST(ClockOffset, AFewMillisecondsAndOneOutlierArePossible) {
  ClockOffset clocks;
  for (int i = 0; i < 100; ++i) {
    const Time now = Time{5'000'000} + milliseconds(10 * i);
    clocks.add({now, now + milliseconds(i == 50 ? 30 : 4), now, now});
    ASSERT_FALSE(clocks.is_impossible());
  }
}

// Smaller than the delays, so that no latency becomes impossible.
TEST(ClockOffset, AStepOfEitherClockIsNoDelay) {
  for (const double step_s : {0.15, -0.15}) {
    for (const bool of_robot : {true, false}) {
      TwoSites sites;
      sites.jitter_s = 0.02;
      ClockOffset clocks;
      sites.run(&clocks, 5);
      (of_robot ? sites.robot_offset_s : sites.operator_offset_s) += step_s;
      sites.run(&clocks, 4);
      const double robot_step_ms = 1e3 * (of_robot ? step_s : -step_s);
      EXPECT_FALSE(clocks.is_impossible());
      EXPECT_NEAR(ms(clocks.stepped()), robot_step_ms, 15);
      EXPECT_NE(clocks.complaint(), "");
      (of_robot ? sites.robot_offset_s : sites.operator_offset_s) -= step_s;
      sites.run(&clocks, 4);
      EXPECT_EQ(clocks.complaint(), "") << "stepped back";
    }
  }
}

TEST(ClockOffset, AStepThatMendsTheClocksIsForgotten) {
  TwoSites sites;
  sites.operator_offset_s = -3;
  ClockOffset clocks;
  sites.run(&clocks, 5);
  EXPECT_NE(clocks.complaint(), "");
  sites.operator_offset_s = 0;
  sites.run(&clocks, 5);
  EXPECT_EQ(clocks.complaint(), "");
}

// What a step of the operator's clock looks like from the first state on.
TEST(ClockOffset, IsRightFromTheFirstStatesAfterAStep) {
  TwoSites sites;
  ClockOffset clocks;
  sites.run(&clocks, 5);
  sites.operator_offset_s = -3;
  sites.run(&clocks, 0.1);
  EXPECT_TRUE(clocks.is_impossible());
  EXPECT_NEAR(ms(clocks.offset()), 3000, 310);
}

TEST(ClockOffset, CommandsThatAreRefusedForTheirStampsLeaveASuspicion) {
  TwoSites sites;
  ClockOffset clocks;
  sites.run(&clocks, 5);
  sites.operator_offset_s = 3;
  sites.is_command_refused = true;
  sites.run(&clocks, 5);
  EXPECT_FALSE(clocks.uplink());
  EXPECT_NE(clocks.complaint().find("do the clocks differ"), std::string::npos)
      << clocks.complaint();
  sites.operator_offset_s = 0;
  sites.is_command_refused = false;
  sites.run(&clocks, 3);
  EXPECT_EQ(clocks.complaint(), "");
}

TEST(ClockOffset, CommandsThatAreLostAreNoSuspicion) {
  TwoSites sites;
  ClockOffset clocks;
  sites.run(&clocks, 5);
  sites.is_command_refused = true;
  sites.run(&clocks, 5);
  EXPECT_EQ(clocks.complaint(), "");
}

TEST(ClockOffset, AbsurdStampsAreHarmless) {
  constexpr int64_t kStamps[] = {std::numeric_limits<int64_t>::min(), -1, 0, 1,
                                 std::numeric_limits<int64_t>::max()};
  ClockOffset clocks;
  for (int i = 0; i < 625; ++i) {
    clocks.add({{kStamps[i % 5]}, {kStamps[i / 5 % 5]}, {kStamps[i / 25 % 5]}, {kStamps[i / 125]}});
    static_cast<void>(clocks.complaint());
    static_cast<void>(clocks.round_trip());
  }
  TwoSites sites;
  sites.run(&clocks, 30);
  EXPECT_FALSE(clocks.is_impossible());
}

}  // namespace
}  // namespace foresight
