// Processes on a simulated clock, one of them (or all) under fire: genuine traffic goes on, and
// between it come thousands of absurd messages (mutator.h) on all inputs. Then: nobody died, no
// memory grew, and two seconds after the last one everything is as before.
//
//   RobotLine arena;                        // or ClosedLoopArena: the whole system
//   Attack attack(arena, {.process = "calibrator", .seed = 1, .mutants = 10'000});
//   if (std::string fault = attack.run(&progress); !fault.empty()) …
//
// What is obeyed when it is valid (PENDANT, SLAM_COMMAND; ARM_ENCODERS: LCM authenticates nobody)
// is left out unless `orders` says otherwise, and then only death and memory are judged. Health,
// which tells of the last seconds, must be good again after eight.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/simulation.h"
#include "foresight/health_t.hpp"
#include "tests/fuzz/mutator.h"
#include "tests/fuzz/tape.h"

namespace foresight::fuzz {

/// What is attacked.
class Arena {
 public:
  virtual ~Arena() = default;
  virtual Simulation& world() = 0;
  /// Names of the processes that may be attacked.
  virtual std::vector<std::string> processes() const = 0;
  /// Runs the world, and whatever feeds it.
  virtual void run_for(double seconds) = 0;
  /// So long until everything is OK.
  virtual double warm_up_s() const = 0;
  /// What a process said; called for everything that is published, in order.
  virtual void on_message(Domain domain, const std::string& channel,
                          std::span<const uint8_t> bytes) = 0;
  /// Forgets what was seen so far and judges from now on.
  virtual void begin_judging() = 0;
  /// What is not as it should be, in words; "" when all is well. Health is judged by the attack.
  virtual std::string find_fault() = 0;
};

struct AttackOptions {
  std::string process = "all";  // or one of the arena's
  uint64_t seed = 1;
  int64_t mutants = 10'000;
  std::string channel = {};  // only this one; empty: all inputs
  bool orders = false;
  double duration_s = 4;
  Tape* tape = nullptr;                              // all that is thrown is written there
  const std::vector<Thrown>* throw_again = nullptr;  // these, at their times, and no others
};

/// Where an attack is; plain data, so that it can lie in memory that outlives the process.
struct Progress {
  int64_t thrown = 0, refused_at_the_border = 0;
  double rss_before_mb = 0, rss_after_mb = 0;  // of the process that holds the arena
  char last[400] = "";                         // the last mutant: channel and what was changed
};

class Attack {
 public:
  Attack(Arena& arena, const AttackOptions& options);
  ~Attack();
  Attack(const Attack&) = delete;
  Attack& operator=(const Attack&) = delete;

  /// Returns the first fault, or "".
  std::string run(Progress* progress);

 private:
  struct Target {
    Domain domain;
    std::string channel;
    const MessageSchema* schema;
  };
  struct Seen {
    std::deque<std::vector<uint8_t>> oldest, newest;  // genuine messages
  };

  void remember(Domain domain, const std::string& channel, std::span<const uint8_t> bytes);
  void choose_targets();
  void throw_all(Progress* progress);
  void throw_one(Progress* progress);
  void throw_due(size_t* next, Progress* progress);
  const std::vector<uint8_t>& sample(const Target& target);
  std::string judge_function();
  std::string judge_health();

  Arena& arena_;
  AttackOptions options_;
  Mutator mutator_;
  std::mt19937_64 random_;
  std::vector<Target> targets_;
  std::map<std::pair<Domain, std::string>, Seen> seen_;
  std::map<std::string, health_t> health_;
};

}  // namespace foresight::fuzz
