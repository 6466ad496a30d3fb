// The live host without a network: LCM's memq provider carries messages inside this process.
#include "common/live_host.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <thread>

#include "common/errors.h"
#include "common/node.h"
#include "common/realtime.h"
#include "foresight/sim_clock_t.hpp"
#include "foresight/slam_command_t.hpp"
#include "tests/common/files.h"

namespace foresight {
namespace {

sim_clock_t clock_message(int64_t utime) {
  sim_clock_t message{};
  message.utime = utime;
  return message;
}

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

// A process that has just begun cannot have heard it yet.
TEST_F(LiveHostTest, MissesTheClockWhenASecondHasPassedWithoutIt) {
  host_.follow_published_clock(Domain::kRobot);
  EXPECT_EQ(host_.complaint(), "");
  const auto begin = std::chrono::steady_clock::now();
  while (host_.complaint().empty() &&
         std::chrono::steady_clock::now() - begin < std::chrono::seconds(60)) {
    std::this_thread::yield();
  }
  EXPECT_EQ(host_.complaint(), "no CLOCK: does sim run?");
  EXPECT_GT(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(900));
}

// What tells a world that was silent from a process that was: whether CLOCK came meanwhile.
TEST_F(LiveHostTest, AWorldThatComesBackIsAnotherClockAndAProcessThatWasStoppedIsNot) {
  host_.follow_published_clock(Domain::kRobot);
  Node node("n", host_, {});
  auto clock = node.advertise<sim_clock_t>({.channel = "CLOCK"});
  const auto stop_for_a_while = [&] {
    for (int i = 1; i <= 1200; ++i) clock.publish(clock_message(5'000'000 + 1000 * i));
    std::this_thread::sleep_for(std::chrono::milliseconds(1200));
  };
  bool came_back = false;
  constexpr int64_t kBack_us = 6'500'000;  // a port takes nothing that lies a second ahead
  node.subscribe<sim_clock_t>({.channel = "CLOCK"}, Queue::kAll, [&](const sim_clock_t& m) {
    if (m.utime == 5'000'000) stop_for_a_while();
    if (m.utime < kBack_us) EXPECT_EQ(host_.clock_changes(), 1) << "it has begun";
    if (m.utime != kBack_us) return;
    came_back = true;
    EXPECT_EQ(host_.clock_changes(), 2);
    host_.stop(0);
  });
  // Due 0.2 s after the last CLOCK, in a world that then stands still for a second.
  host_.call_at(host_.now() + milliseconds(1600), [&] { clock.publish(clock_message(kBack_us)); });
  clock.publish(clock_message(5'000'000));
  stop_after(seconds(60));
  EXPECT_EQ(host_.run(), 0);
  EXPECT_TRUE(came_back);
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

// Timers, of a host whose clock a stranger pushes about.
TEST_F(LiveHostTest, TimersGoOnWhateverComesOnClock) {
  host_.follow_published_clock(Domain::kRobot);
  Node node("n", host_, {});
  auto clock = node.advertise<sim_clock_t>({.channel = "CLOCK"});
  int ticks = 0, published = 0;
  host_.call_every(milliseconds(10), [&] { ++ticks; });
  node.subscribe<sim_clock_t>({.channel = "CLOCK"}, Queue::kAll, [&](const sim_clock_t& m) {
    if (m.utime != 5'000'000 + 1000 * published) return;  // a forged one
    if (++published == 200) return host_.stop(0);
    if (published % 50 == 0) clock.publish(clock_message(INT64_MAX));
    if (published % 50 == 25) clock.publish(clock_message(1'000'000));
    clock.publish(clock_message(5'000'000 + 1000 * published));
  });
  clock.publish(clock_message(5'000'000));
  stop_after(seconds(3600));
  host_.run();
  EXPECT_EQ(published, 200);
  EXPECT_NEAR(ticks, 19, 2) << "in 199 ms of the world's time";
}

TEST_F(LiveHostTest, TimersHaveTheirTurnWhileMoreArrivesThanCanBeHandled) {
  Node node("n", host_, {});
  auto out = node.advertise<slam_command_t>({.channel = "C"});
  int handled = 0, ticks = 0, handled_at_first_tick = 0;
  node.subscribe<slam_command_t>({.channel = "C"}, Queue::kAll, [&](const slam_command_t&) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    if (++handled == 100) host_.stop(0);
  });
  for (int i = 0; i < 100; ++i) out.publish({});
  host_.call_every(milliseconds(10), [&] {
    if (++ticks == 1) handled_at_first_tick = handled;
  });
  host_.run();
  EXPECT_EQ(handled, 100) << "and nothing is lost";
  EXPECT_LT(handled_at_first_tick, 60);
  EXPECT_GT(handled_at_first_tick, 0);
}

// Many instants a microsecond apart, scheduled while the machine holds this thread up.
TEST_F(LiveHostTest, AnEarlierInstantIsAnEarlierTimer) {
  std::vector<int> order;
  const Time begin = host_.now() + milliseconds(300);
  for (int i = 0; i < 2000; ++i) {
    if (i % 100 == 0) std::this_thread::sleep_for(std::chrono::microseconds(300));
    host_.call_at(begin + microseconds(i / 10), [&order, i] { order.push_back(i); });
  }
  stop_after(seconds(1));
  host_.run();
  EXPECT_EQ(order.size(), 2000u);
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end()));
}

// The last one: what was signalled to this process stays so.
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

// A clock that gets its world's messages every 2 ms, and what a stranger sends between them.
class DisputedClock : public testing::Test {
 protected:
  void go_on(Duration duration) {
    for (const int64_t end_us = here_us_ + duration.us; here_us_ < end_us;) {
      here_us_ += 2000;
      world_us_ += 2000;
      clock_.on_message(encode(clock_message(world_us_)), here_us_);
    }
  }
  void forge(int64_t utime) { clock_.on_message(encode(clock_message(utime)), here_us_); }
  int64_t now_us() const { return clock_.now({}, here_us_).us; }

  PublishedClock clock_;
  int64_t here_us_ = 50'000'000, world_us_ = 1'700'000'000'000'000;
};

TEST_F(DisputedClock, AStepThatNoWorldMakesIsNotBelieved) {
  go_on(seconds(1));
  for (const int64_t utime :
       {INT64_MAX, INT64_MIN, int64_t{-1}, int64_t{0}, int64_t{5'000'000}, world_us_ + 1'000'000,
        world_us_ - 1'000'000, world_us_ + 3'600'000'000, int64_t{4'000'000'000'000'000}}) {
    forge(utime);
    EXPECT_EQ(now_us(), world_us_) << utime;
    go_on(milliseconds(10));
    EXPECT_EQ(now_us(), world_us_) << utime;
  }
  EXPECT_TRUE(clock_.is_disputed(here_us_));
  go_on(seconds(3));
  EXPECT_FALSE(clock_.is_disputed(here_us_));
}

TEST_F(DisputedClock, ALogThatIsPlayedBesideTheWorldIsNotFollowed) {
  go_on(seconds(1));
  for (int64_t played_us = world_us_ - 600'000'000, i = 0; i < 5000; ++i) {
    forge(played_us += 2000);
    go_on(milliseconds(2));
    ASSERT_EQ(now_us(), world_us_);
  }
}

TEST_F(DisputedClock, ASmallForgedStepIsForgottenInATenthOfASecond) {
  go_on(seconds(1));
  forge(world_us_ + 15'000);
  go_on(milliseconds(110));
  EXPECT_EQ(now_us(), world_us_);
}

TEST_F(DisputedClock, AFirstMessageOfAStrangerYieldsToTheWorld) {
  forge(4'000'000'000'000'000);
  go_on(milliseconds(110));
  EXPECT_EQ(now_us(), world_us_);
}

TEST_F(DisputedClock, AWorldThatIsStartedAnewIsFollowed) {
  go_on(seconds(1));
  here_us_ += 2'000'000;
  world_us_ = 1'600'000'000'000'000;
  go_on(milliseconds(6));
  EXPECT_EQ(now_us(), world_us_);
}

TEST_F(DisputedClock, AProcessThatWasStoppedCatchesUp) {
  go_on(seconds(1));
  here_us_ += 5'000'000;  // messages of five seconds were lost
  world_us_ += 5'000'000;
  go_on(milliseconds(2));
  EXPECT_EQ(now_us(), world_us_);
}

TEST(RealTime, IsGivenUpByWhatSpins) {
  const pid_t child = fork();
  if (child == 0) {
    if (!schedule_in_real_time(1)) _exit(2);
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!has_lost_real_time() && std::chrono::steady_clock::now() < end) {
    }
    _exit(has_lost_real_time() && sched_getscheduler(0) == SCHED_OTHER ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == 2) GTEST_SKIP() << "no right to real-time scheduling";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace foresight
