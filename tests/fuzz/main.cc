// model-fuzz: random and hostile maps through the cores of carver and mesher, checked after every
// step. Episodes run in a child process, so that a crash or a hang is reported like any fault.
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <exception>
#include <string>

#include "common/tool_main.h"
#include "tests/fuzz/episode.h"

namespace {

using foresight::fuzz::Episode;
using foresight::fuzz::Tally;

constexpr unsigned kStepLimit_s = 300;  // one step takes milliseconds; sanitized, swapping: seconds
constexpr double kProgressPeriod_s = 10;

struct Arguments {
  uint64_t seed = 1;
  double seconds = 60;
  int64_t steps = 0;  // 0: until the time is over
};

// Where the child is; in memory that outlives it.
struct Position {
  uint64_t episode_seed;
  int64_t episode_step, steps, episodes;
  Tally tally;  // of finished episodes
};

// The first episode has the seed of the run: each can be replayed by itself.
uint64_t episode_seed(uint64_t seed, int64_t episode) {
  if (episode == 0) return seed;
  uint64_t h = seed + 0x9E3779B97F4A7C15u * static_cast<uint64_t>(episode);
  h = (h ^ h >> 30) * 0xBF58476D1CE4E5B9u;
  h = (h ^ h >> 27) * 0x94D049BB133111EBu;
  return h ^ h >> 31;
}

class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

void add(const Tally& tally, Tally* sum) {
  sum->ignored_entries += tally.ignored_entries;
  sum->thinned_constraints += tally.thinned_constraints;
  sum->rebuilds += tally.rebuilds;
  sum->refused_deltas += tally.refused_deltas;
  sum->taken_corrupted += tally.taken_corrupted;
  sum->cells += tally.cells;
  sum->split_vertices += tally.split_vertices;
  sum->split_edges += tally.split_edges;
}

void print_progress(const Position& at, double seconds) {
  const auto n = [](int64_t number) { return static_cast<long long>(number); };
  const Tally& t = at.tally;
  std::printf("%.0f s: %lld steps (%.0f/s) in %lld episodes; ", seconds, n(at.steps),
              static_cast<double>(at.steps) / seconds, n(at.episodes));
  std::printf("%lld map entries ignored, %lld constraints thinned, %lld rebuilds, ",
              n(t.ignored_entries), n(t.thinned_constraints), n(t.rebuilds));
  std::printf("%lld deltas refused, %lld corrupted ones taken, ", n(t.refused_deltas),
              n(t.taken_corrupted));
  std::printf("%lld cells compared, %lld vertices and %lld edges split\n", n(t.cells),
              n(t.split_vertices), n(t.split_edges));
  std::fflush(stdout);
}

void print_fault(const Position& at, const std::string& fault) {
  std::printf(
      "FAULT at seed %llu, step %lld: %s\n  again: scripts/run model-fuzz --seed %llu --steps "
      "%lld\n",
      static_cast<unsigned long long>(at.episode_seed), static_cast<long long>(at.episode_step),
      fault.substr(0, 2000).c_str(), static_cast<unsigned long long>(at.episode_seed),
      static_cast<long long>(at.episode_step));
  std::fflush(stdout);
}

std::string guarded_step(Episode& episode) {
  alarm(kStepLimit_s);
  try {
    return episode.step();
  } catch (const std::exception& e) {
    return std::string("exception: ") + e.what();
  }
}

// Returns whether no fault was found.
bool run_episodes(const Arguments& arguments, Position* at) {
  const Stopwatch watch;
  double next_progress = kProgressPeriod_s;
  while (true) {
    at->episode_seed = episode_seed(arguments.seed, at->episodes);
    at->episode_step = 0;
    Episode episode(at->episode_seed);
    while (!episode.is_over()) {
      const double now = watch.seconds();
      const bool is_done =
          arguments.steps > 0 ? at->steps >= arguments.steps : now > arguments.seconds;
      if (is_done) {
        print_progress(*at, now);
        return true;
      }
      if (now > next_progress) {
        print_progress(*at, now);
        next_progress = now + kProgressPeriod_s;
      }
      ++at->episode_step;
      if (const std::string fault = guarded_step(episode); !fault.empty()) {
        print_fault(*at, fault + "\n  " + episode.description());
        return false;
      }
      ++at->steps;
    }
    ++at->episodes;
    add(episode.tally(), &at->tally);
  }
}

// Runs `work` in a child; returns whether it went well. A child that ends otherwise is a fault.
bool run_in_child(const Arguments& arguments, Position* at) {
  const pid_t child = fork();
  if (child < 0) {
    std::perror("model-fuzz: fork");
    return false;
  }
  if (child == 0) std::exit(run_episodes(arguments, at) ? 0 : 1);
  int status = 0;
  waitpid(child, &status, 0);
  if (WIFEXITED(status) && WEXITSTATUS(status) <= 1 && at->steps > 0)
    return WEXITSTATUS(status) == 0;
  const bool is_signal = WIFSIGNALED(status);
  const bool is_alarm = is_signal && WTERMSIG(status) == SIGALRM;
  print_fault(*at, is_alarm    ? "the step does not end"
                   : is_signal ? "ended by signal " + std::to_string(WTERMSIG(status))
                               : "exit code " + std::to_string(WEXITSTATUS(status)));
  return false;
}

int fuzz(const Arguments& arguments) {
  void* shared =
      mmap(nullptr, sizeof(Position), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (shared == MAP_FAILED) throw foresight::UnavailableError("no memory to share with a child");
  auto* at = new (shared) Position{};
  std::printf("model-fuzz: seed %llu\n", static_cast<unsigned long long>(arguments.seed));
  std::fflush(stdout);
  if (!run_in_child(arguments, at)) return foresight::kExitFault;
  std::printf("model-fuzz: no fault in %lld steps\n", static_cast<long long>(at->steps));
  return foresight::kExitDone;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Fuzzes carving and meshing: exit code 1, and how to see it again, on a fault",
               "model-fuzz");
  app.add_option("--seed", arguments.seed, "of the first episode; decides all that follow")
      ->capture_default_str();
  app.add_option("--seconds", arguments.seconds, "how long")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--steps", arguments.steps, "stop after this many steps, however long it takes")
      ->check(CLI::PositiveNumber);
  return foresight::tool_main(app, argc, argv, [&] { return fuzz(arguments); });
}
