// message-fuzz: absurd messages into the running system, round after round, each a system of its
// own with one process under fire. A round runs in a child process, so that a crash or a hang is
// reported like any fault, with the command that shows it again.
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cctype>
#include <chrono>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>

#include "common/errors.h"
#include "common/tool_main.h"
#include "tests/fuzz/closed_loop_arena.h"
#include "tests/fuzz/robot_line.h"
#include "tests/fuzz/shrinker.h"

namespace {

using foresight::ClosedLoop;
using foresight::fuzz::Arena;
using foresight::fuzz::Attack;
using foresight::fuzz::AttackOptions;
using foresight::fuzz::ClosedLoopArena;
using foresight::fuzz::Progress;
using foresight::fuzz::RobotLine;
using foresight::fuzz::Tape;
using foresight::fuzz::Thrown;

constexpr unsigned kRoundLimit_s =
    3600;  // a round takes a minute; sanitized, on a busy machine: many
constexpr size_t kMaxFault = 1000;
constexpr size_t kTapeBytes = size_t{2} << 30;

struct Arguments {
  AttackOptions attack;
  std::string arena = "loop";
  std::vector<std::string> processes;  // in turn
  double seconds = 60;
  int64_t rounds = 0;   // 0: until the time is over
  double shrink_s = 0;  // so long after a fault
};

struct Shared {
  Progress progress;
  char fault[kMaxFault];
};

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::unique_ptr<Arena> make_arena(const std::string& name) {
  if (name == "line") return std::make_unique<RobotLine>();
  return std::make_unique<ClosedLoopArena>();
}

void run_round(const std::string& arena_name, const AttackOptions& options, Shared* shared) {
  alarm(kRoundLimit_s);
  std::string fault;
  try {
    const std::unique_ptr<Arena> arena = make_arena(arena_name);
    fault = Attack(*arena, options).run(&shared->progress);
  } catch (const foresight::StartupError& e) {
    fault = e.what();
  } catch (const std::exception& e) {
    fault = std::string("exception: ") + e.what();
  }
  std::snprintf(shared->fault, sizeof shared->fault, "%s", fault.c_str());
}

// The fault of one round, or "".
std::string run_in_child(const std::string& arena_name, const AttackOptions& options,
                         Shared* shared) {
  *shared = {};
  std::fflush(stdout);
  const pid_t child = fork();
  if (child < 0) return "fork failed";
  if (child == 0) {
    // What the processes say of each refused message is not what is looked for.
    if (std::freopen("/dev/null", "w", stderr) == nullptr) _exit(71);
    run_round(arena_name, options, shared);
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return shared->fault;
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) return "it does not end";
  return WIFSIGNALED(status) ? "ended by signal " + std::to_string(WTERMSIG(status))
                             : "exit code " + std::to_string(WEXITSTATUS(status));
}

void print_fault(const std::string& arena, const AttackOptions& o, const Shared& shared,
                 const std::string& fault) {
  std::printf(
      "FAULT: %s\n  last thrown: %lld: %s\n  again: scripts/run message-fuzz --arena %s --process "
      "%s --seed "
      "%llu "
      "--mutants %lld --during %g --rounds 1%s%s%s\n",
      fault.c_str(), static_cast<long long>(shared.progress.thrown), shared.progress.last,
      arena.c_str(), o.process.c_str(), static_cast<unsigned long long>(o.seed),
      static_cast<long long>(o.mutants), o.duration_s, o.channel.empty() ? "" : " --channel ",
      o.channel.c_str(), o.orders ? " --orders" : "");
  std::fflush(stdout);
}

// Without its numbers, which change with what is thrown.
std::string kind_of(std::string fault) {
  fault = fault.substr(0, fault.find(" ("));  // nor what was believed
  std::erase_if(fault, [](unsigned char c) { return std::isdigit(c) || c == '.' || c == '-'; });
  return fault;
}

void print_thrown(const std::vector<Thrown>& all) {
  std::printf("  %zu messages make it:\n", all.size());
  for (const Thrown& t : all) {
    std::printf("    %.3f s before the last: %s, %s: %s\n", (all.back().time - t.time).seconds(),
                to_string(t.domain), t.channel.c_str(), t.what.c_str());
  }
  std::fflush(stdout);
}

// Throws ever fewer of the messages of a faulty round, as long as they make the same fault.
void look_for_few(const std::string& arena, AttackOptions options, const std::string& fault,
                  double for_s, Shared* shared) {
  Tape tape(kTapeBytes);
  options.tape = &tape;
  if (kind_of(run_in_child(arena, options, shared)) != kind_of(fault)) {
    std::printf("  the same round once more has no such fault: it cannot be made smaller\n");
    return;
  }
  options.tape = nullptr;
  const std::vector<Thrown> all = tape.read();
  if (all.empty()) {
    std::printf("  more was thrown than can be kept: it cannot be made smaller\n");
    return;
  }
  std::vector<Thrown> some;
  const auto choose = [&](const std::vector<size_t>& indices) {
    some.clear();
    for (const size_t i : indices) some.push_back(all[i]);
  };
  options.throw_again = &some;
  const auto fails = [&](const std::vector<size_t>& indices) {
    choose(indices);
    const bool same = kind_of(run_in_child(arena, options, shared)) == kind_of(fault);
    if (same) std::printf("  %zu still make it\n", indices.size());
    std::fflush(stdout);
    return same;
  };
  const double end_s = now_s() + for_s;
  choose(foresight::fuzz::shrink(all.size(), fails, [end_s] { return now_s() > end_s; }));
  print_thrown(some);
}

int run(Arguments arguments, Shared* shared) {
  const double begin_s = now_s();
  int64_t thrown = 0, refused = 0, faults = 0, round = 0;
  for (; arguments.rounds > 0 ? round < arguments.rounds : now_s() - begin_s < arguments.seconds;
       ++round) {
    AttackOptions options = arguments.attack;
    options.process = arguments.processes[static_cast<size_t>(round) % arguments.processes.size()];
    options.seed += static_cast<uint64_t>(round);
    const std::string fault = run_in_child(arguments.arena, options, shared);
    thrown += shared->progress.thrown;
    refused += shared->progress.refused_at_the_border;
    if (!fault.empty()) {
      print_fault(arguments.arena, options, *shared, fault);
      if (arguments.shrink_s > 0) {
        look_for_few(arguments.arena, options, fault, arguments.shrink_s, shared);
      }
    }
    faults += fault.empty() ? 0 : 1;
    std::printf(
        "%.0f s: round %lld at %s: %lld thrown in all, of which %lld had to be refused at the "
        "border; RSS %.0f MB before, %.0f after\n",
        now_s() - begin_s, static_cast<long long>(round + 1), options.process.c_str(),
        static_cast<long long>(thrown), static_cast<long long>(refused),
        shared->progress.rss_before_mb, shared->progress.rss_after_mb);
    std::fflush(stdout);
  }
  std::printf("message-fuzz: %lld faults in %lld rounds, %lld messages\n",
              static_cast<long long>(faults), static_cast<long long>(round),
              static_cast<long long>(thrown));
  return faults == 0 ? 0 : 1;
}

void declare_options(CLI::App& app, Arguments& a) {
  app.add_option("--seed", a.attack.seed, "of the first round; the next takes the next")
      ->capture_default_str();
  app.add_option("--seconds", a.seconds, "begin rounds for so long")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--rounds", a.rounds, "stop after so many rounds, however long they take")
      ->check(CLI::PositiveNumber);
  app.add_option("--mutants", a.attack.mutants, "messages in a round")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--during", a.attack.duration_s, "seconds in which they are thrown")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--process", a.processes,
                 "under fire, in turn (repeatable; all: everybody who listens); default: each")
      ->allow_extra_args(false);
  app.add_option("--channel", a.attack.channel, "only this one");
  app.add_flag("--orders", a.attack.orders,
               "PENDANT, SLAM_COMMAND and ARM_ENCODERS too, which are obeyed: only death and "
               "memory are judged");
  app.add_option("--shrink", a.shrink_s,
                 "after a fault, look so many seconds for the few messages that make it")
      ->check(CLI::PositiveNumber);
  app.add_option("--arena", a.arena,
                 "loop: the whole system; line: carver, mesher and calibrator, many times faster")
      ->check(CLI::IsMember({"loop", "line"}))
      ->capture_default_str();
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app(
      "Throws absurd messages at the running system: exit code 1, and how to see it again, on a "
      "fault",
      "message-fuzz");
  declare_options(app, arguments);
  return foresight::tool_main(app, argc, argv, [&] {
    if (arguments.processes.empty()) {
      arguments.processes = arguments.arena == "line"
                                ? std::vector<std::string>{"carver", "mesher", "calibrator", "all"}
                                : ClosedLoop::processes();
    }
    void* memory =
        mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw foresight::UnavailableError("no memory to share with a child");
    return run(arguments, new (memory) Shared{});
  });
}
