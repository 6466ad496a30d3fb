// The link between two simulated domains, and on this machine's clock.
#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "common/live_host.h"
#include "common/simulation.h"
#include "foresight/health_t.hpp"
#include "foresight/sim_clock_t.hpp"
#include "procs/link/process.h"

namespace foresight {
namespace {

class LinkProcessTest : public testing::Test {
 protected:
  void start(const LinkParams& params) {
    world_.add("link", {Domain::kRobot, Domain::kOperator},
               [&](Node& node) { return std::make_unique<LinkProcess>(node, params); });
    for (const Domain domain : {Domain::kRobot, Domain::kOperator}) {
      for (const char* channel : {"VIEW", "MESH", "SLAM_COMMAND"}) {
        world_.listen(domain, channel, [this, domain, channel](auto bytes) {
          arrivals_.push_back({domain, channel, {bytes.begin(), bytes.end()}, world_.now()});
        });
      }
    }
    world_.listen(Domain::kOperator, "HEALTH", [this](auto bytes) {
      ASSERT_GT(health_.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
    });
    world_.listen(Domain::kOperator, "LINK_STATS", [this](auto bytes) {
      ASSERT_GT(stats_.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
    });
  }
  void send(Domain domain, const std::string& channel, std::vector<uint8_t> bytes) {
    world_.inject(world_.now(), domain, channel, std::move(bytes));
  }
  const link_flow_t& flow(const std::string& channel) {
    for (const link_flow_t& f : stats_.flows) {
      if (f.channel == channel) return f;
    }
    ADD_FAILURE() << "no flow " << channel;
    return stats_.flows.at(0);
  }
  struct Arrival {
    Domain domain;
    std::string channel;
    std::vector<uint8_t> bytes;
    Time time;
  };
  health_t health_{};
  Simulation world_{Time{1'000'000}};
  std::vector<Arrival> arrivals_;
  link_stats_t stats_{};
};

TEST_F(LinkProcessTest, CarriesBytesUnreadAndDelayedPerDirection) {
  LinkParams params;
  params.to_operator.delay_s = 0.2;
  params.to_robot.delay_s = 0.05;
  start(params);
  send(Domain::kRobot, "VIEW", {1, 2, 3});  // no message of ours: the link does not care
  send(Domain::kOperator, "SLAM_COMMAND", {});
  world_.run_until(world_.now() + seconds(1));
  ASSERT_EQ(arrivals_.size(), 4u);  // each is heard where it is sent and where it arrives
  EXPECT_EQ(arrivals_[2].domain, Domain::kRobot);
  EXPECT_EQ(arrivals_[2].channel, "SLAM_COMMAND");
  EXPECT_EQ(arrivals_[2].time - arrivals_[1].time, milliseconds(50));
  EXPECT_EQ(arrivals_[3].domain, Domain::kOperator);
  EXPECT_EQ(arrivals_[3].bytes, (std::vector<uint8_t>{1, 2, 3}));
  EXPECT_EQ(arrivals_[3].time - arrivals_[0].time, milliseconds(200));
}

TEST_F(LinkProcessTest, CarriesOnlyTheChannelsThatAreListed) {
  LinkParams params;
  params.to_operator_channels = {"MESH"};
  start(params);
  send(Domain::kRobot, "VIEW", {1});
  send(Domain::kRobot, "MESH", {2});
  send(Domain::kOperator, "MESH", {3});
  world_.run_until(world_.now() + seconds(1));
  int at_operator = 0, at_robot = 0;
  for (const Arrival& a : arrivals_) {
    if (a.domain == Domain::kOperator) {
      EXPECT_EQ(a.channel, "MESH");
      ++at_operator;
    } else {
      EXPECT_NE(a.bytes.at(0), 3) << "MESH does not go back";
      ++at_robot;
    }
  }
  EXPECT_EQ(at_operator, 2);
  EXPECT_EQ(at_robot, 2);
}

TEST_F(LinkProcessTest, CountsWhatItDid) {
  LinkParams params;
  params.to_operator = {.delay_s = 0.1, .loss = 0.25};
  start(params);
  for (int i = 0; i < 1000; ++i) {
    send(Domain::kRobot, "VIEW", {1});
    world_.run_until(world_.now() + milliseconds(1));
  }
  world_.run_until(world_.now() + seconds(2));
  EXPECT_EQ(flow("VIEW").forwarded + flow("VIEW").lost, 1000);
  EXPECT_NEAR(static_cast<double>(flow("VIEW").lost), 250, 50);
  EXPECT_EQ(flow("VIEW").queued, 0);
  EXPECT_EQ(flow("MESH").forwarded, 0);
}

TEST_F(LinkProcessTest, ReportsTheMeanDelayOfTheLastSecond) {
  LinkParams params;
  params.to_operator.delay_s = 0.1;
  start(params);
  send(Domain::kRobot, "VIEW", {1});
  world_.run_until(Time{2'500'000});
  EXPECT_NEAR(flow("VIEW").delay_ms, 100, 1e-3);
  EXPECT_EQ(flow("VIEW").delay_error_ms, 0);
  world_.run_until(Time{3'500'000});
  EXPECT_EQ(flow("VIEW").delay_ms, 0) << "nothing passed in that second";
}

TEST_F(LinkProcessTest, MayReorderAndCountsIt) {
  LinkParams params;
  params.to_operator = {.delay_s = 0.1, .reorder = 0.2};
  start(params);
  for (uint8_t i = 0; i < 200; ++i) {
    send(Domain::kRobot, "VIEW", {i});
    world_.run_until(world_.now() + milliseconds(10));
  }
  world_.run_until(world_.now() + seconds(2));
  EXPECT_EQ(flow("VIEW").forwarded, 200);
  EXPECT_GT(flow("VIEW").reordered, 10);
}

TEST_F(LinkProcessTest, CarriesTheRobotsHealthButReportsItsOwnInBothDomains) {
  start({});
  int own = 0;
  world_.listen(Domain::kOperator, "HEALTH", [&](auto bytes) {
    health_t h;
    ASSERT_GT(h.decode(bytes.data(), 0, static_cast<int>(bytes.size())), 0);
    own += h.process == "link" ? 1 : 0;
  });
  world_.run_until(world_.now() + seconds(5.5));
  EXPECT_GE(own, 5);
}

TEST_F(LinkProcessTest, WhatIsUnderWayIsBounded) {
  LinkParams params;
  params.to_operator.delay_s = 60;
  params.queue_limit_mb = 1;
  start(params);
  for (int i = 0; i < 5000; ++i) send(Domain::kRobot, "VIEW", std::vector<uint8_t>(1000));
  send(Domain::kOperator, "SLAM_COMMAND", {1});
  world_.run_until(world_.now() + seconds(2));
  EXPECT_NEAR(flow("VIEW").queued, 800, 10);
  EXPECT_EQ(flow("VIEW").queued + flow("VIEW").rate_dropped, 5000);
  EXPECT_EQ(arrivals_.back().domain, Domain::kRobot) << "the other direction is free";
  EXPECT_EQ(health_.state, int{health_t::STATE_DEGRADED});
  EXPECT_NE(health_.reason.find("to_operator: more than queue_limit_mb"), std::string::npos)
      << health_.reason;
  world_.run_until(world_.now() + seconds(80));
  EXPECT_EQ(flow("VIEW").queued, 0);
  EXPECT_EQ(health_.state, int{health_t::STATE_OK}) << health_.reason;
}

// Bursts through a link on a real clock, whose departures are microseconds apart.
TEST(LinkOnAMachine, KeepsTheOrderOfBursts) {
  LiveHost host("memq://", "memq://");
  Node node("link", host, {});
  LinkParams params;
  params.to_operator = {.delay_s = 0.05, .jitter_s = 0.002};
  params.realtime = false;
  LinkProcess link(node, params);
  link.start();
  std::vector<int> order;
  Node ends("ends", host, {});
  ends.subscribe_raw({.channel = "VIEW", .domain = Domain::kOperator}, Queue::kAll,
                     [&](auto bytes) {
                       order.push_back(bytes[0] * 256 + bytes[1]);
                       if (order.size() == 3000) host.stop(0);
                     });
  int sent = 0;
  host.call_every(milliseconds(1), [&] {
    for (int i = 0; i < 30 && sent < 3000; ++i, ++sent) {
      host.publish(Domain::kRobot, "VIEW",
                   std::vector{static_cast<uint8_t>(sent / 256), static_cast<uint8_t>(sent % 256)});
    }
  });
  host.call_at(host.now() + seconds(60), [&] { host.stop(1); });
  EXPECT_EQ(host.run(), 0);
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
}

// A loop that stands still, as one of a stopped process does.
TEST(LinkOnAMachine, SaysThatItStoodStill) {
  LiveHost host("memq://", "memq://");
  Node node("link", host, {Domain::kRobot});
  LinkParams params;
  params.realtime = false;
  LinkProcess link(node, params);
  link.start();
  Node ends("ends", host, {});
  std::string reason;
  ends.subscribe<health_t>({.channel = "HEALTH"}, Queue::kAll, [&](const health_t& m) {
    reason = m.reason;
    if (m.state == health_t::STATE_DEGRADED) host.stop(0);
  });
  host.call_at(host.now() + milliseconds(200),
               [] { std::this_thread::sleep_for(std::chrono::milliseconds(400)); });
  host.call_at(host.now() + seconds(60), [&] { host.stop(1); });
  EXPECT_EQ(host.run(), 0);
  EXPECT_TRUE(reason.starts_with("stood still for 0.")) << reason;
}

// A simulated world that ends, and another one: link went on all the time.
TEST(LinkOnAMachine, AnotherWorldIsNoStall) {
  LiveHost host("memq://", "memq://");
  host.follow_published_clock(Domain::kRobot);
  Node node("link", host, {Domain::kRobot});
  LinkParams params;
  params.realtime = false;
  LinkProcess link(node, params);
  link.start();
  Node ends("ends", host, {});
  auto clock = ends.advertise<sim_clock_t>({.channel = "CLOCK"});
  const auto tell = [&](int64_t utime) {
    sim_clock_t message{};
    message.utime = utime;
    clock.publish(message);
  };
  std::vector<std::string> reasons;
  ends.subscribe<health_t>({.channel = "HEALTH"}, Queue::kAll,
                           [&](const health_t& m) { reasons.push_back(m.reason); });
  tell(5'000'000);
  // After a second without CLOCK this host goes on by itself.
  host.call_at(host.now() + milliseconds(200), [&] { tell(8'000'000); });
  host.call_at(host.now() + milliseconds(1500), [&] { host.stop(0); });
  EXPECT_EQ(host.run(), 0);
  ASSERT_FALSE(reasons.empty());
  for (const std::string& reason : reasons) {
    EXPECT_EQ(reason.find("stood still"), std::string::npos) << reason;
  }
}

}  // namespace
}  // namespace foresight
