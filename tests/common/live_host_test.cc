// The live host without a network: LCM's memq provider carries messages inside this process.
#include "common/live_host.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <thread>

#include "common/errors.h"
#include "common/node.h"
#include "foresight/sim_clock_t.hpp"
#include "foresight/slam_command_t.hpp"
#include "tests/common/files.h"

namespace foresight {
namespace {

// One LCM instance per domain in this process: what is published comes back.
class LiveHostTest : public testing::Test {
 protected:
  void stop_after(Duration d) {
    host_.call_at(host_.now() + d, [this] { host_.stop(0); });
  }
  LiveHost host_{"memq://", "memq://"};
};

TEST_F(LiveHostTest, DeliversMessages) {
  Node node("n", host_, {});
  auto out = node.advertise<slam_command_t>({.channel = "C"});
  int received = 0;
  node.subscribe<slam_command_t>({.channel = "C"}, Queue::kAll, [&](const slam_command_t&) {
    if (++received == 100) host_.stop(3);
  });
  for (int i = 0; i < 100; ++i) out.publish({});
  EXPECT_EQ(host_.run(), 3);
}

TEST_F(LiveHostTest, KLatestSkipsAllButTheNewest) {
  Node node("n", host_, {});
  auto out = node.advertise<slam_command_t>({.channel = "C"});
  std::vector<int64_t> received;
  node.subscribe<slam_command_t>({.channel = "C"}, Queue::kLatest,
                                 [&](const slam_command_t& m) { received.push_back(m.utime); });
  slam_command_t message{};
  for (message.utime = 0; message.utime < 50; ++message.utime) out.publish(message);
  stop_after(milliseconds(200));
  host_.run();
  ASSERT_FALSE(received.empty());
  EXPECT_EQ(received.back(), 49);
  EXPECT_EQ(node.ports().back().skipped, 50 - static_cast<int64_t>(received.size()));
}

TEST_F(LiveHostTest, TimersFireInOrderAndDoNotPileUp) {
  std::vector<int> order;
  int ticks = 0;
  const Time begin = host_.now();
  host_.call_at(begin + milliseconds(40), [&] { order.push_back(2); });
  host_.call_at(begin + milliseconds(20), [&] { order.push_back(1); });
  host_.call_every(milliseconds(1), [&] {
    ++ticks;
    if (ticks == 1) std::this_thread::sleep_for(std::chrono::milliseconds(60));  // a slow handler
  });
  stop_after(milliseconds(100));
  host_.run();
  EXPECT_EQ(order, (std::vector{1, 2}));
  EXPECT_LT(ticks, 60) << "missed periods are skipped, not caught up";
  EXPECT_GT(ticks, 2);
}

TEST_F(LiveHostTest, TimersThatTakeLongerThanTheirPeriodDoNotStarveMessages) {
  Node node("n", host_, {});
  auto out = node.advertise<slam_command_t>({.channel = "C"});
  int received = 0;
  node.subscribe<slam_command_t>({.channel = "C"}, Queue::kAll, [&](const slam_command_t&) {
    if (++received == 10) host_.stop(3);
  });
  for (int i = 0; i < 3; ++i) {
    host_.call_every(milliseconds(2),
                     [] { std::this_thread::sleep_for(std::chrono::milliseconds(5)); });
  }
  host_.call_every(milliseconds(10), [&] { out.publish({}); });
  stop_after(seconds(60));
  EXPECT_EQ(host_.run(), 3) << received << " messages handled";
}

// A world that runs at its own pace: its timers and stamps are its own.
TEST_F(LiveHostTest, LivesByAPublishedClock) {
  host_.follow_published_clock(Domain::kRobot);
  Node node("n", host_, {});
  auto clock = node.advertise<sim_clock_t>({.channel = "CLOCK"});
  constexpr int64_t kBegin_us = 5'000'000;
  int ticks = 0, published = 0;
  Time at_single;
  host_.call_every(milliseconds(10), [&] { ++ticks; });
  host_.call_at(host_.now() + milliseconds(55), [&] { at_single = host_.now(); });
  Time last;
  bool monotonic = true;
  node.subscribe<sim_clock_t>({.channel = "CLOCK"}, Queue::kAll, [&](const sim_clock_t&) {
    monotonic = monotonic && host_.now() >= last;
    last = host_.now();
    if (++published == 100) return host_.stop(0);
    sim_clock_t next{};
    next.utime = kBegin_us + 1000 * published;
    clock.publish(next);
  });
  sim_clock_t first{};
  first.utime = kBegin_us;
  clock.publish(first);
  host_.run();
  EXPECT_TRUE(monotonic);
  EXPECT_EQ(host_.now().us, kBegin_us + 99'000);
  EXPECT_NEAR(ticks, 9, 1) << "in 99 ms of the world's time";
  EXPECT_NEAR(static_cast<double>(at_single.us - kBegin_us), 55e3, 3e3);
}

// Two streams, each faster than its slow handler, beside a timer that takes longer than its period.
TEST_F(LiveHostTest, AnOverloadedLoopStillHandlesEveryChannel) {
  Node node("n", host_, {});
  auto a = node.advertise<slam_command_t>({.channel = "A"});
  auto b = node.advertise<slam_command_t>({.channel = "B"});
  int handled_a = 0, handled_b = 0;
  const auto slow = [this](int* handled, const int* other) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    if (++*handled >= 10 && *other >= 10) host_.stop(3);
  };
  node.subscribe<slam_command_t>({.channel = "A"}, Queue::kLatest,
                                 [&](const slam_command_t&) { slow(&handled_a, &handled_b); });
  node.subscribe<slam_command_t>({.channel = "B"}, Queue::kLatest,
                                 [&](const slam_command_t&) { slow(&handled_b, &handled_a); });
  host_.call_every(milliseconds(1), [&] {
    a.publish({});
    b.publish({});
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  });
  stop_after(seconds(60));
  EXPECT_EQ(host_.run(), 3) << handled_a << " and " << handled_b << " handled";
}

TEST_F(LiveHostTest, AJobRunsBesideTheMainThread) {
  Node node("n", host_, {});
  std::thread::id job_thread, apply_thread;
  ASSERT_TRUE(node.run_beside(
      [&]() -> std::function<void()> {
        job_thread = std::this_thread::get_id();
        return [&] {
          apply_thread = std::this_thread::get_id();
          host_.stop(0);
        };
      },
      Duration{0}));
  host_.run();
  EXPECT_NE(job_thread, std::this_thread::get_id());
  EXPECT_EQ(apply_thread, std::this_thread::get_id());
}

TEST_F(LiveHostTest, AJobYieldsToTheLoopWhateverThePriorityOfTheProcess) {
  Node node("n", host_, {});
  int of_job = 0;
  ASSERT_TRUE(node.run_beside(
      [&]() -> std::function<void()> {
        of_job = getpriority(PRIO_PROCESS, 0);
        return [&] { host_.stop(0); };
      },
      Duration{0}));
  host_.run();
  EXPECT_EQ(of_job, std::min(19, getpriority(PRIO_PROCESS, 0) + 5));
}

// A job may still run when the process is told to end; it must not outlive what it works on.
TEST_F(LiveHostTest, RunReturnsOnlyWhenTheJobHasEnded) {
  Node node("n", host_, {});
  std::atomic<bool> began{false}, ended{false};
  ASSERT_TRUE(node.run_beside(
      [&]() -> std::function<void()> {
        began = true;
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        ended = true;
        return [] {};
      },
      Duration{0}));
  host_.call_every(milliseconds(1), [&] {
    if (began) host_.stop(0);
  });
  host_.run();
  EXPECT_TRUE(ended);
}

TEST_F(LiveHostTest, SignalsEndItCleanly) {
  for (const int signal : {SIGINT, SIGTERM}) {
    LiveHost host("memq://", "memq://");
    host.call_at(host.now() + milliseconds(5), [&] { std::raise(signal); });
    EXPECT_EQ(host.run(), 0);
  }
}

TEST(LcmBus, SaysWhatMendsABadUrl) {
  const std::string line = error_of<UnavailableError>([] { LcmBus bus("nonsense://"); });
  EXPECT_NE(line.find("nonsense://"), std::string::npos);
  EXPECT_NE(line.find("scripts/setup --network"), std::string::npos);
}

sim_clock_t clock_message(int64_t utime) {
  sim_clock_t message{};
  message.utime = utime;
  return message;
}

TEST(PublishedClock, FallsBackToThePaceOfTheWallWhenItIsSilent) {
  PublishedClock clock;
  const Time wall{77'000'000};
  EXPECT_EQ(clock.now(wall, 100), wall) << "not begun";
  clock.on_message(encode(clock_message(3'000'000)), 1'000'000);
  EXPECT_EQ(clock.now(wall, 1'900'000).us, 3'000'000) << "a pause of the world";
  EXPECT_FALSE(clock.is_silent(1'900'000));
  EXPECT_TRUE(clock.is_silent(2'500'000));
  EXPECT_EQ(clock.now(wall, 4'000'000).us, 5'000'000) << "two seconds after the silence began";
}

TEST(PublishedClock, IgnoresWhatIsNoClock) {
  PublishedClock clock;
  clock.on_message(encode(clock_message(3'000'000)), 0);
  std::vector<uint8_t> damaged = encode(clock_message(9'000'000));
  damaged.pop_back();
  clock.on_message(damaged, 1);
  clock.on_message(encode(slam_command_t{}), 2);
  EXPECT_EQ(clock.rejected(), 2);
  EXPECT_EQ(clock.now({}, 3).us, 3'000'000);
}

}  // namespace
}  // namespace foresight
