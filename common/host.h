// What a process needs from its surroundings: a clock, a bus, timers, one worker. Three hosts
// exist: LiveHost (LCM, wall clock), Simulation (many processes, one thread, one simulated clock;
// also replays logs) and DescribeHost (only --describe). What a process does must not depend on which
// it has; the few that keep things for the next of the same run are told so by their main().
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "common/time.h"

namespace foresight {

/// The two LCM domains: the robot's site and the operator's. Only `link` and a renderer of recorded
/// video have ports in both.
enum class Domain : uint8_t { kRobot, kOperator };
const char* to_string(Domain domain);

/// A job for the worker: runs on copied data, returns what to do with its result on the main
/// thread.
using Job = std::function<std::function<void()>()>;

/// Full queues: keep every message, or only the newest (the rest is counted as skipped).
enum class Queue : uint8_t { kAll, kLatest };

struct Usage {
  double cpu_s = 0;
  double memory_mb = 0;
};

class Host {
 public:
  using Handler = std::function<void(std::span<const uint8_t> bytes)>;

  virtual ~Host() = default;
  virtual Time now() const = 0;
  /// On a simulated clock handlers take no time, and no figure of the real machine may be
  /// published.
  virtual bool is_simulated() const = 0;
  virtual void publish(Domain domain, const std::string& channel,
                       std::span<const uint8_t> bytes) = 0;
  /// `skipped` is incremented for each message that kLatest passes over; it outlives the host.
  virtual void subscribe(Domain domain, const std::string& channel, Queue queue, int64_t* skipped,
                         Handler handler) = 0;
  virtual void call_every(Duration period, std::function<void()> call) = 0;
  virtual void call_at(Time time, std::function<void()> call) = 0;
  /// Live: beside the main thread, its result applied at the next message border. Simulated: the
  /// job runs at once and its result is applied `simulated_cost` later.
  virtual void run_job(Job job, Duration simulated_cost) = 0;
  /// Ends the process's loop after the current handler.
  virtual void stop(int exit_code) = 0;
  /// How often the clock has become another one: that of a world which began anew, or came back
  /// after a silence. What is measured across such a change is no duration.
  virtual int64_t clock_changes() const { return 0; }
  virtual Usage usage() const { return {}; }
  /// One line when the host works worse than it should (small socket buffers …), else empty.
  virtual std::string complaint() const { return {}; }
};

}  // namespace foresight
