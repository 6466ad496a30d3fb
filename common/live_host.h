// The host of a deployed process: LCM, a clock, one loop in one thread, one worker.
//
// The clock is the wall clock, or the time of a simulated world that publishes CLOCK (sim): then a
// machine that is too slow for the world makes everything slower, not wrong.
#pragma once

#include <array>
#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <queue>
#include <string>
#include <thread>
#include <vector>

#include "common/host.h"
#include "common/lcm_bus.h"

namespace foresight {

/// Runs at most one job at a time in a thread of its own and signals an eventfd when it is done.
/// The thread yields to the loops (nice).
class Worker {
 public:
  Worker();
  ~Worker();
  void run(Job job);
  int file_descriptor() const { return event_; }
  /// The finished job's result, or an empty function.
  std::function<void()> take_result();

 private:
  void loop();
  int event_;
  std::mutex mutex_;
  std::condition_variable wake_;
  Job job_;
  std::function<void()> result_;
  bool stopping_ = false;
  std::thread thread_;
};

/// Where a process takes its time from.
enum class ClockSource : uint8_t { kWall, kPublished };

/// The time of a world that publishes it. Until the first CLOCK it is the wall clock; when CLOCK
/// falls silent it goes on at the wall clock's pace, so that health and time-outs still work.
///
/// A world's clock goes on in small steps. A message that does not continue the present stream is
/// not believed; but when what came instead continues itself, and the present stream has said
/// nothing meanwhile, the world was started anew and its clock is taken: after 3 messages when the
/// present stream has been silent for a second, else after 50 (a tenth of a second).
class PublishedClock {
 public:
  /// A message on CLOCK; one that is no CLOCK is counted and ignored.
  void on_message(std::span<const uint8_t> bytes, int64_t monotonic_us);
  /// `wall` and `monotonic_us` are those of now.
  Time now(Time wall, int64_t monotonic_us) const;
  bool is_silent(int64_t monotonic_us) const;
  int64_t rejected() const { return rejected_; }
  /// Messages that did not continue the stream that is believed came within the last two seconds.
  bool is_disputed(int64_t monotonic_us) const;

 private:
  struct Stream {
    Time newest;
    int64_t monotonic_us = 0;
    int count = 0;  // messages, each of which continues the one before; 0: none
    bool continues_with(Time time, int64_t monotonic_us) const;
  };
  void take(Stream* stream, Time time, int64_t monotonic_us);

  Stream present_, candidate_;
  int64_t disputed_us_ = 0, rejected_ = 0;
};

class LiveHost : public Host {
 public:
  LiveHost(std::string robot_url, std::string operator_url);
  /// Lives by the CLOCK of that domain. Call before anything is scheduled.
  void follow_published_clock(Domain domain);
  ~LiveHost() override;

  /// Handles messages, timers and results until stop() or SIGINT/SIGTERM; returns the exit code.
  int run();

  Time now() const override;
  bool is_simulated() const override { return false; }
  void publish(Domain domain, const std::string& channel, std::span<const uint8_t> bytes) override;
  void subscribe(Domain domain, const std::string& channel, Queue queue, int64_t* skipped,
                 Handler handler) override;
  void call_every(Duration period, std::function<void()> call) override;
  void call_at(Time time, std::function<void()> call) override;
  void run_job(Job job, Duration simulated_cost) override;
  void stop(int exit_code) override;
  int64_t clock_changes() const override { return clock_changes_; }
  Usage usage() const override;
  std::string complaint() const override;

 private:
  struct Subscription {
    Handler handler;
    Queue queue;
    int64_t* skipped;
    int64_t waiting = 0;  // messages of this subscription in the inbox
  };
  struct Arrival {
    Subscription* subscription;
    std::vector<uint8_t> bytes;
  };
  struct Timer {
    int64_t due_us;
    int64_t order;
    Duration period;  // zero: once
    std::shared_ptr<std::function<void()>> call;
    bool operator>(const Timer& o) const {
      return due_us != o.due_us ? due_us > o.due_us : order > o.order;
    }
  };

  LcmBus& bus(Domain domain);
  int64_t timer_us() const;
  int64_t wall_offset_us();
  void keep_timers(const std::function<void()>& change_of_clock);
  void receive();
  void handle_arrivals();
  void run_due_timers();
  void wait();

  std::array<std::string, 2> urls_;
  std::array<std::unique_ptr<LcmBus>, 2> buses_;
  std::vector<std::unique_ptr<Subscription>> subscriptions_;
  std::deque<Arrival> inbox_;
  std::unique_ptr<PublishedClock> clock_;  // none: the wall clock
  int64_t clock_begun_us_ = 0;             // since when it is followed
  int64_t clock_changes_ = 0;
  bool world_is_silent_ = true;  // all that came was read, and no CLOCK was among it
  std::priority_queue<Timer, std::vector<Timer>, std::greater<>> timers_;
  int64_t timer_order_ = 0;
  int64_t wall_offset_us_ = 0;            // monotonic − wall clock
  int64_t dropped_ = 0, dropped_us_ = 0;  // by the buses; when there were some last
  std::unique_ptr<Worker> worker_;
  bool stopping_ = false;
  int exit_code_ = 0;
};

}  // namespace foresight
