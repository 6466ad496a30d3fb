#include "common/realtime.h"

#include <sched.h>
#include <sys/resource.h>

#include <array>
#include <atomic>
#include <csignal>
#include <cstdlib>
#include <filesystem>

namespace foresight {
namespace {

constexpr rlim_t kLongestRun_us = 500'000;

// What the signal's handler may touch: the threads that were given the policy.
std::array<std::atomic<pid_t>, 32> g_threads{};
std::atomic<bool> g_is_lost{false};

void on_spinning(int) {
  const sched_param ordinary{};
  for (const auto& thread : g_threads) {
    if (thread != 0) sched_setscheduler(thread, SCHED_OTHER, &ordinary);
  }
  g_is_lost = true;
}

// The kernel counts what a thread with a real-time policy computes between two waits.
bool watch_for_spinning() {
  struct sigaction action {};
  action.sa_handler = on_spinning;
  action.sa_flags = SA_RESTART;
  const rlimit limit{kLongestRun_us, RLIM_INFINITY};
  return sigaction(SIGXCPU, &action, nullptr) == 0 && setrlimit(RLIMIT_RTTIME, &limit) == 0;
}

}  // namespace

bool schedule_in_real_time(int priority) {
  if (!watch_for_spinning()) return false;
  sched_param param{};
  param.sched_priority = priority;
  size_t count = 0;
  bool all = true;
  std::error_code error;
  for (const auto& task : std::filesystem::directory_iterator("/proc/self/task", error)) {
    const pid_t thread = std::atoi(task.path().filename().c_str());
    if (count == g_threads.size()) return false;
    g_threads[count++] = thread;
    all = sched_setscheduler(thread, SCHED_FIFO, &param) == 0 && all;
  }
  return all && !error;
}

bool has_lost_real_time() { return g_is_lost; }

}  // namespace foresight
