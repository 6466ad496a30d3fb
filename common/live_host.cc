#include "common/live_host.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <fstream>
#include <utility>

#include "common/check.h"
#include "common/message_check.h"
#include "common/realtime.h"
#include "foresight/sim_clock_t.hpp"

namespace foresight {
namespace {

volatile std::sig_atomic_t g_signalled = 0;
int g_signal_event = -1;

void on_signal(int) {
  g_signalled = 1;
  const uint64_t one = 1;
  [[maybe_unused]] const auto n = write(g_signal_event, &one, sizeof one);
}

void install_signal_handlers() {
  g_signal_event = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  struct sigaction action {};
  action.sa_handler = on_signal;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

// A job is given to a worker because it may take long: the loops (control, tracking, drawing) go
// first.
constexpr int kWorkerNice = 5;

// A published clock that says nothing for so long has stopped.
constexpr int64_t kClockSilence_us = 1'000'000;
// Between two messages a world goes on by at most this, and what its fastest pace makes of the time
// that has passed here (sim's parameter speed).
constexpr Duration kClockStep = milliseconds(20);
constexpr int64_t kLargestClockPace = 100;
constexpr int64_t kLatestClock_us = 4'102'444'800'000'000;  // the year 2100
constexpr int kMessagesAfterSilence = 3, kMessagesOfANewClock = 50;
constexpr int64_t kDispute_us = 2'000'000;

// Messages are handled for so long, then timers have their turn.
constexpr int64_t kHandling_us = 50'000;
// The wall clock is set when it is off by more than this from what it was.
constexpr int64_t kWallStep_us = 1'000;
constexpr int64_t kDropsAreNews_us = 5'000'000;

// Timers must fire in spite of a stepping wall clock; messages carry the wall clock.
int64_t monotonic_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

int64_t wall_clock_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace

Worker::Worker() : event_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)), thread_([this] { loop(); }) {}

Worker::~Worker() {
  {
    std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_one();
  thread_.join();
  close(event_);
}

void Worker::run(Job job) {
  {
    std::lock_guard lock(mutex_);
    FORESIGHT_CHECK(!job_);
    job_ = std::move(job);
  }
  wake_.notify_one();
}

void Worker::loop() {
  // Linux: of this thread alone, on top of the process's. Needs no right.
  [[maybe_unused]] const int niceness = nice(kWorkerNice);
  while (true) {
    Job job;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [this] { return stopping_ || job_; });
      if (stopping_) return;
      job = std::move(job_);
      job_ = nullptr;
    }
    std::function<void()> result = job();
    {
      std::lock_guard lock(mutex_);
      result_ = std::move(result);
    }
    const uint64_t one = 1;
    [[maybe_unused]] const auto n = write(event_, &one, sizeof one);
  }
}

std::function<void()> Worker::take_result() {
  uint64_t count = 0;
  [[maybe_unused]] const auto n = read(event_, &count, sizeof count);
  std::lock_guard lock(mutex_);
  auto result = std::move(result_);
  result_ = nullptr;
  return result;
}

bool PublishedClock::Stream::continues_with(Time time, int64_t now_us) const {
  const Duration step = time - newest;
  const Duration largest = kClockStep + microseconds(now_us - monotonic_us) * kLargestClockPace;
  return count > 0 && step.us >= 0 && step <= largest;
}

void PublishedClock::take(Stream* stream, Time time, int64_t monotonic_us) {
  *stream = {time, monotonic_us, std::min(stream->count + 1, kMessagesOfANewClock)};
}

void PublishedClock::on_message(std::span<const uint8_t> bytes, int64_t monotonic_us) {
  const auto message = decode_checked<sim_clock_t>(bytes);
  if (!message || message->utime < 0 || message->utime > kLatestClock_us) {
    ++rejected_;
    return;
  }
  const Time time{message->utime};
  if (present_.count == 0 || present_.continues_with(time, monotonic_us)) {
    candidate_ = {};
    return take(&present_, time, monotonic_us);
  }
  disputed_us_ = monotonic_us;
  if (!candidate_.continues_with(time, monotonic_us)) candidate_ = {};
  take(&candidate_, time, monotonic_us);
  const int needed = is_silent(monotonic_us) ? kMessagesAfterSilence : kMessagesOfANewClock;
  if (candidate_.count >= needed) present_ = std::exchange(candidate_, {});
}

bool PublishedClock::is_silent(int64_t monotonic_us) const {
  return present_.count == 0 || monotonic_us - present_.monotonic_us > kClockSilence_us;
}

bool PublishedClock::is_disputed(int64_t monotonic_us) const {
  return disputed_us_ > 0 && monotonic_us - disputed_us_ < kDispute_us;
}

Time PublishedClock::now(Time wall, int64_t monotonic_us) const {
  if (present_.count == 0) return wall;
  const int64_t silence_us = monotonic_us - present_.monotonic_us - kClockSilence_us;
  return present_.newest + microseconds(std::max<int64_t>(0, silence_us));
}

LiveHost::LiveHost(std::string robot_url, std::string operator_url)
    : urls_{std::move(robot_url), std::move(operator_url)} {
  install_signal_handlers();
}

LiveHost::~LiveHost() { worker_.reset(); }

LcmBus& LiveHost::bus(Domain domain) {
  auto& slot = buses_[static_cast<size_t>(domain)];
  if (!slot) slot = std::make_unique<LcmBus>(urls_[static_cast<size_t>(domain)]);
  return *slot;
}

void LiveHost::follow_published_clock(Domain domain) {
  clock_ = std::make_unique<PublishedClock>();
  clock_begun_us_ = monotonic_us();
  bus(domain).subscribe("CLOCK", [this](const std::string&, auto bytes) {
    keep_timers([&] { clock_->on_message(bytes, monotonic_us()); });
  });
}

Time LiveHost::now() const {
  const Time wall{wall_clock_us()};
  return clock_ ? clock_->now(wall, monotonic_us()) : wall;
}

// Timers live by the published clock where there is one.
int64_t LiveHost::timer_us() const { return clock_ ? now().us : monotonic_us(); }

// A clock that begins, comes back after a silence, or belongs to a world that was restarted jumps:
// what was to happen in a second still happens in a second.
void LiveHost::keep_timers(const std::function<void()>& change_of_clock) {
  const bool was_silent = clock_->is_silent(monotonic_us());
  const int64_t before_us = timer_us();
  change_of_clock();
  const int64_t jump_us = timer_us() - before_us;
  const bool came_back = world_is_silent_ && !clock_->is_silent(monotonic_us());
  if (came_back || (!was_silent && jump_us < 0)) ++clock_changes_;
  if (came_back) world_is_silent_ = false;
  if (!was_silent && jump_us >= 0 && jump_us < kClockSilence_us) return;
  decltype(timers_) moved;
  for (; !timers_.empty(); timers_.pop()) {
    Timer timer = timers_.top();
    timer.due_us += jump_us;
    moved.push(std::move(timer));
  }
  timers_ = std::move(moved);
}

void LiveHost::publish(Domain domain, const std::string& channel, std::span<const uint8_t> bytes) {
  bus(domain).publish(channel, bytes);
}

void LiveHost::subscribe(Domain domain, const std::string& channel, Queue queue, int64_t* skipped,
                         Handler handler) {
  subscriptions_.push_back(
      std::make_unique<Subscription>(Subscription{std::move(handler), queue, skipped}));
  Subscription* subscription = subscriptions_.back().get();
  bus(domain).subscribe(channel, [this, subscription](const std::string&, auto bytes) {
    inbox_.push_back({subscription, {bytes.begin(), bytes.end()}});
    ++subscription->waiting;
  });
}

void LiveHost::call_every(Duration period, std::function<void()> call) {
  timers_.push({timer_us() + period.us, timer_order_++, period,
                std::make_shared<std::function<void()>>(std::move(call))});
}

// Monotonic − wall clock, the same for all calls until somebody sets the wall clock: of two
// instants the earlier one is then the earlier timer, too.
int64_t LiveHost::wall_offset_us() {
  const int64_t before_us = monotonic_us();
  const int64_t wall_us = wall_clock_us();
  const int64_t after_us = monotonic_us();
  // The offset lies between these two, far apart when this thread was held up between the readings.
  const bool fits = before_us - wall_us <= wall_offset_us_ + kWallStep_us &&
                    after_us - wall_us >= wall_offset_us_ - kWallStep_us;
  if (!fits) wall_offset_us_ = before_us - wall_us;
  return wall_offset_us_;
}

void LiveHost::call_at(Time time, std::function<void()> call) {
  const int64_t due = clock_ ? time.us : time.us + wall_offset_us();
  timers_.push(
      {due, timer_order_++, {0}, std::make_shared<std::function<void()>>(std::move(call))});
}

void LiveHost::run_job(Job job, Duration) {
  if (!worker_) worker_ = std::make_unique<Worker>();
  worker_->run(std::move(job));
}

void LiveHost::stop(int exit_code) {
  stopping_ = true;
  exit_code_ = exit_code;
}

Usage LiveHost::usage() const {
  rusage r{};
  getrusage(RUSAGE_SELF, &r);
  const auto seconds_of = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_usec) * 1e-6;
  };
  int64_t total_pages = 0, resident_pages = 0;
  std::ifstream("/proc/self/statm") >> total_pages >> resident_pages;
  return {seconds_of(r.ru_utime) + seconds_of(r.ru_stime),
          static_cast<double>(resident_pages * sysconf(_SC_PAGESIZE)) / 1e6};
}

std::string LiveHost::complaint() const {
  for (const auto& bus : buses_) {
    if (bus && !bus->complaint().empty()) return bus->complaint();
  }
  const bool awaits_clock = monotonic_us() - clock_begun_us_ <= kClockSilence_us;
  if (clock_ && clock_->is_silent(monotonic_us()) && !awaits_clock) {
    return "no CLOCK: does sim run?";
  }
  if (clock_ && clock_->is_disputed(monotonic_us())) {
    return "CLOCK from another world, not followed: are there two of sim, or is a log played?";
  }
  if (has_lost_real_time()) {
    return "computed for half a second without a pause: real-time scheduling given up";
  }
  if (dropped_us_ > 0 && monotonic_us() - dropped_us_ < kDropsAreNews_us) {
    return "too slow for what it hears: " + std::to_string(dropped_) + " messages dropped so far";
  }
  return {};
}

void LiveHost::receive() {
  int64_t dropped = 0;
  for (auto& bus : buses_) {
    if (!bus) continue;
    bus->receive();
    dropped += bus->dropped();
  }
  // A process that was stopped itself finds what came meanwhile: then nobody was silent.
  if (clock_ && clock_->is_silent(monotonic_us())) world_is_silent_ = true;
  if (dropped > dropped_) dropped_us_ = monotonic_us();
  dropped_ = dropped;
}

// Everything that has arrived, before the timers: then even a loop whose timers take all the time
// handles the newest message of each channel once a pass, and a slow timer (drawing) works on the
// newest. But not for ever: timers go on when more arrives than can be handled.
void LiveHost::handle_arrivals() {
  const int64_t end_us = monotonic_us() + kHandling_us;
  while (!inbox_.empty() && !stopping_ && g_signalled == 0 && monotonic_us() < end_us) {
    const Arrival arrival = std::move(inbox_.front());
    inbox_.pop_front();
    Subscription& subscription = *arrival.subscription;
    --subscription.waiting;
    if (subscription.queue == Queue::kLatest && subscription.waiting > 0) {
      ++*subscription.skipped;
      continue;
    }
    subscription.handler(arrival.bytes);
  }
}

// Only what is due on entry, and a periodic timer again at its next whole period after its call: a
// timer that takes longer than its period must not starve messages.
void LiveHost::run_due_timers() {
  const int64_t entry_us = timer_us();
  while (!stopping_ && !timers_.empty() && timers_.top().due_us <= entry_us) {
    Timer timer = timers_.top();
    timers_.pop();
    (*timer.call)();
    if (timer.period.us <= 0) continue;
    const int64_t missed = std::max<int64_t>(0, timer_us() - timer.due_us) / timer.period.us;
    timer.due_us += (missed + 1) * timer.period.us;
    timers_.push(timer);
  }
}

void LiveHost::wait() {
  std::array<pollfd, 4> fds{};
  nfds_t count = 0;
  const auto add = [&](int fd) { fds[count++] = {fd, POLLIN, 0}; };
  add(g_signal_event);
  for (auto& bus : buses_) {
    if (bus) add(bus->file_descriptor());
  }
  if (worker_) add(worker_->file_descriptor());
  timespec timeout{1, 0};
  // With a published clock a timer becomes due when CLOCK says so.
  if (!timers_.empty() && !(clock_ && !clock_->is_silent(monotonic_us()))) {
    const int64_t us = std::max<int64_t>(0, timers_.top().due_us - timer_us());
    timeout = {us / 1'000'000, (us % 1'000'000) * 1000};
  }
  ppoll(fds.data(), count, &timeout, nullptr);
}

int LiveHost::run() {
  while (!stopping_ && g_signalled == 0) {
    if (inbox_.empty()) receive();  // what waits longer is bounded by the bus
    handle_arrivals();
    if (worker_) {
      if (auto result = worker_->take_result()) result();
    }
    run_due_timers();
    if (inbox_.empty() && !stopping_ && g_signalled == 0) wait();
  }
  worker_.reset();  // a job must not outlive the process that it works for
  return exit_code_;
}

}  // namespace foresight
