#include "procs/top/health_table.h"

#include <gtest/gtest.h>

namespace foresight {
namespace {

constexpr Time kStart{1'000'000'000};

health_t make_health(const std::string& process, Time utime, int8_t state = health_t::STATE_OK,
                     const std::string& reason = "") {
  health_t h{};
  h.utime = utime.us;
  h.process = process;
  h.pid = 100;
  h.state = state;
  h.reason = reason;
  return h;
}

TEST(HealthTable, ShowsTheNewestReportOfEachProcessByName) {
  HealthTable table;
  table.add(kStart, make_health("slam", kStart, health_t::STATE_WAITING, "no IMAGE arrives"));
  table.add(kStart, make_health("camera", kStart));
  table.add(kStart + seconds(1), make_health("slam", kStart + seconds(1)));
  const auto rows = table.rows(kStart + seconds(1));
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].health.process, "camera");
  EXPECT_EQ(rows[1].state(), "OK");
  EXPECT_EQ(rows[0].age, seconds(1));
}

TEST(HealthTable, IgnoresTheLinksLateCopyOfAReport) {
  HealthTable table;
  table.add(kStart, make_health("slam", kStart, health_t::STATE_WAITING));
  table.add(kStart + seconds(1), make_health("slam", kStart + seconds(1), health_t::STATE_OK));
  table.add(kStart + seconds(1.2), make_health("slam", kStart, health_t::STATE_WAITING));
  table.add(kStart + seconds(1.2), make_health("slam", kStart + seconds(1), health_t::STATE_OK));
  const auto rows = table.rows(kStart + seconds(2));
  EXPECT_EQ(rows[0].state(), "OK");
  EXPECT_EQ(rows[0].age, seconds(1)) << "a copy is no sign of life";
}

TEST(HealthTable, ASilentProcessIsGoneAndComesBack) {
  HealthTable table;
  table.add(kStart, make_health("slam", kStart));
  EXPECT_FALSE(table.rows(kStart + kGoneAfter)[0].is_gone);
  EXPECT_EQ(table.rows(kStart + kGoneAfter + microseconds(1))[0].state(), "GONE");
  table.add(kStart + seconds(9), make_health("slam", kStart + seconds(9)));
  EXPECT_EQ(table.rows(kStart + seconds(9))[0].state(), "OK");
}

TEST(HealthTable, AProcessBackFromSilenceIsBelievedThoughItsClockWasSetBack) {
  HealthTable table;
  table.add(kStart, make_health("slam", kStart));
  table.add(kStart + seconds(9), make_health("slam", kStart - seconds(100)));
  EXPECT_FALSE(table.rows(kStart + seconds(9))[0].is_gone);
}

TEST(HealthTable, CountsRestartsByPid) {
  HealthTable table;
  health_t h = make_health("slam", kStart);
  table.add(kStart, h);
  h.utime += 1;
  table.add(kStart, h);
  EXPECT_EQ(table.rows(kStart)[0].restarts, 0);
  h.utime += 1;
  h.pid = 101;
  table.add(kStart, h);
  EXPECT_EQ(table.rows(kStart)[0].restarts, 1);
}

TEST(HealthTable, MissingNamesWhoAndWhy) {
  HealthTable table;
  table.add(kStart, make_health("slam", kStart, health_t::STATE_WAITING, "no IMAGE arrives"));
  table.add(kStart, make_health("link", kStart));
  table.add(kStart, make_health("camera", kStart, health_t::STATE_DONE));
  const std::vector<std::string> names = {"slam", "link", "camera", "mesher"};
  EXPECT_EQ(table.missing(names, Wanted::kAlive, kStart),
            std::vector<std::string>{"mesher (no health heard)"});
  EXPECT_EQ(
      table.missing(names, Wanted::kOk, kStart),
      (std::vector<std::string>{"slam (WAITING: no IMAGE arrives)", "mesher (no health heard)"}));
  EXPECT_EQ(table.missing({"link"}, Wanted::kAlive, kStart + seconds(4)),
            std::vector<std::string>{"link (GONE)"});
  EXPECT_TRUE(table.missing({"link", "camera"}, Wanted::kOk, kStart).empty());
}

TEST(HealthTable, KeepsTheNewestLinkStatistics) {
  HealthTable table;
  link_stats_t stats{};
  stats.utime = 10;
  link_flow_t flow{};
  flow.channel = "VIEW";
  flow.to_operator = 1;
  flow.forwarded = 7;
  stats.flows = {flow};
  stats.n_flows = 1;
  table.add(kStart, stats);
  stats.utime = 9;
  stats.flows[0].forwarded = 6;
  table.add(kStart, stats);
  ASSERT_EQ(table.flows().size(), 1u);
  EXPECT_EQ(table.flows()[0].forwarded, 7);
}

TEST(HealthTable, AForgedReportFromTheFutureHidesAProcessForTwoSecondsAtMost) {
  HealthTable table;
  table.add(kStart, make_health("slam", kStart));
  table.add(kStart, make_health("slam", kStart + seconds(1e6), health_t::STATE_FAILED));
  for (double t = 1; t <= 2; ++t) {
    table.add(kStart + seconds(t), make_health("slam", kStart + seconds(t)));
  }
  EXPECT_EQ(table.rows(kStart + seconds(2))[0].state(), "OK");
  link_stats_t stats{};
  stats.utime = (kStart + seconds(1e6)).us;
  table.add(kStart, stats);
  stats.utime = (kStart + seconds(2)).us;
  stats.flows.resize(1);
  table.add(kStart + seconds(2), stats);
  EXPECT_EQ(table.flows().size(), 1u);
}

TEST(HealthTable, ForgedNamesDoNotFillTheMemoryAndDoNotShutOutTheRealOnes) {
  HealthTable table;
  table.add(kStart, make_health("slam", kStart));
  link_stats_t stats{};
  stats.flows.resize(1);
  for (int i = 0; i < 10'000; ++i) {
    table.add(kStart, make_health("forged " + std::to_string(i), kStart));
    stats.flows[0].channel = "FORGED " + std::to_string(i);
    table.add(kStart, stats);
  }
  EXPECT_EQ(table.rows(kStart).size(), kMaxNames);
  EXPECT_EQ(table.flows().size(), kMaxNames);
  const Time later = kStart + seconds(4);
  table.add(later, make_health("slam", later));
  table.add(later, make_health("camera", later));
  EXPECT_TRUE(table.missing({"slam", "camera"}, Wanted::kOk, later).empty());
}

}  // namespace
}  // namespace foresight
