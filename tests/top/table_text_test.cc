#include "procs/top/table_text.h"

#include <gtest/gtest.h>

#include "common/printable_text.h"

namespace foresight {
namespace {

constexpr Time kNow{1'000'000'000};

HealthTable make_table(const std::string& reason) {
  health_t h{};
  h.utime = kNow.us;
  h.process = "slam";
  h.pid = 42;
  h.state = health_t::STATE_DEGRADED;
  h.reason = reason;
  port_health_t in{};
  in.channel = "IMAGE";
  in.is_input = 1;
  in.messages = 300;
  in.rate_hz = 29.9f;
  in.bytes_per_s = 1.25e6f;
  in.worst_latency_ms = 12.34f;
  in.skipped = 5;
  in.lost = 77;
  port_health_t idle{};
  idle.channel = "SLAM_COMMAND";
  idle.is_input = 1;
  h.ports = {in, idle};
  h.n_ports = 2;
  h.metric_names = {"keyframes"};
  h.metric_values = {17};
  h.n_metrics = 1;
  HealthTable table;
  table.add(kNow, h);
  return table;
}

TEST(TableText, ShowsStateRatesBandwidthAndLatency) {
  const std::string text = to_text(make_table("lost"), kNow, Ports::kBusy, Colour::kOff);
  for (const char* part :
       {"slam", "DEGRADED", "lost", "IMAGE", "29.9 Hz", "1.25 MB/s", "12.3", "77"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
  }
  EXPECT_EQ(text.find("SLAM_COMMAND"), std::string::npos) << "it never carried a message";
  EXPECT_NE(to_text(make_table(""), kNow, Ports::kAll, Colour::kOff).find("SLAM_COMMAND"),
            std::string::npos);
}

TEST(TableText, TextFromTheNetworkCannotControlTheTerminal) {
  const std::string text = to_text(make_table("a\x1b[2Jb\nc"), kNow, Ports::kBusy, Colour::kOff);
  EXPECT_EQ(text.find('\x1b'), std::string::npos);
  EXPECT_NE(text.find("a [2Jb c"), std::string::npos);
}

TEST(TableText, JsonIsOneLineAndEscaped) {
  const std::string json = to_json(make_table("say \"no\"\n\\"), kNow);
  EXPECT_EQ(json.find('\n'), std::string::npos);
  EXPECT_NE(json.find(R"("reason":"say \"no\" \\")"), std::string::npos) << json;
  EXPECT_NE(json.find(R"("channel":"IMAGE","direction":"in","domain":"robot","messages":300)"),
            std::string::npos)
      << json;
  EXPECT_NE(json.find(R"("metrics":{"keyframes":17})"), std::string::npos) << json;
}

// A reason that was no UTF-8 broke every reader of the JSON.
TEST(TableText, JsonIsUtf8WhateverAForgedReportHolds) {
  const std::string json = to_json(make_table("a\xff\xfe\xc3 b\xed\xa0\x80 \x1b[2J \u00e9"), kNow);
  EXPECT_EQ(json, printable(json, 1'000'000));
  EXPECT_NE(json.find("\u00e9"), std::string::npos);
}

TEST(TableText, ANegativeAgeIsShownAndNoneIsNone) {
  health_t h{};
  h.utime = kNow.us;
  h.process = "controller";
  port_health_t in{};
  in.channel = "JOINT_COMMAND";
  in.is_input = 1;
  in.messages = 30;
  in.rate_hz = 30;
  in.worst_latency_ms = -2726;
  h.ports = {in};
  HealthTable ahead, silent;
  ahead.add(kNow, h);
  EXPECT_NE(to_text(ahead, kNow, Ports::kBusy, Colour::kOff).find("-2726.0"), std::string::npos);
  EXPECT_NE(to_json(ahead, kNow).find(R"("worst_latency_ms":-2726,)"), std::string::npos);
  h.ports[0].rate_hz = 0;
  h.ports[0].worst_latency_ms = 0;
  silent.add(kNow, h);
  EXPECT_NE(to_json(silent, kNow).find(R"("worst_latency_ms":null,)"), std::string::npos);
}

TEST(TableText, AnEmptyTableSaysSo) {
  EXPECT_EQ(to_text({}, kNow, Ports::kBusy, Colour::kOff), "no process reports\n");
  EXPECT_EQ(to_json({}, kNow), R"({"utime":1000000000,"processes":[],"link":[]})");
}

}  // namespace
}  // namespace foresight
