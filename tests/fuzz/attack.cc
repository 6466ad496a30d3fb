#include "tests/fuzz/attack.h"

#include <malloc.h>
#include <unistd.h>

#include <cstdio>

#include "common/errors.h"
#include "common/message_check.h"
#include "common/message_text.h"

namespace foresight::fuzz {
namespace {

constexpr double kBurst_s = 0.01, kRecovery_s = 2, kJudged_s = 1.5;
// Health says what happened in the last five seconds (lost images), in reports of once a second.
constexpr double kHealthRecovery_s = 4;
constexpr size_t kSamples = 6;  // of each channel, old ones and new ones
// The genuine traffic of the time needs some itself.
constexpr double kMaxGrowth_mb = 40;

// Orders are obeyed, whoever gives them; and an arm whose readings are as often forged as not stops
// with a fault that a person resets.
bool is_obeyed(const std::string& channel) {
  return channel == "PENDANT" || channel == "SLAM_COMMAND" || channel == "ARM_ENCODERS";
}

double heap_mb() { return static_cast<double>(mallinfo2().uordblks) * 1e-6; }

double rss_mb() {
  long pages = 0, resident = 0;
  std::FILE* file = std::fopen("/proc/self/statm", "r");
  if (file == nullptr) return 0;
  const int read = std::fscanf(file, "%ld %ld", &pages, &resident);
  std::fclose(file);
  return read == 2 ? static_cast<double>(resident * sysconf(_SC_PAGESIZE)) * 1e-6 : 0;
}

}  // namespace

Attack::Attack(Arena& arena, const AttackOptions& options)
    : arena_(arena), options_(options), mutator_(options.seed), random_(options.seed) {
  // The tap sees what processes say, and not what is thrown at them.
  arena.world().set_tap([this](Time, Domain domain, const std::string& channel, auto bytes) {
    remember(domain, channel, bytes);
    arena_.on_message(domain, channel, bytes);
  });
}

Attack::~Attack() { arena_.world().set_tap({}); }

void Attack::remember(Domain domain, const std::string& channel, std::span<const uint8_t> bytes) {
  Seen& seen = seen_[{domain, channel}];
  if (seen.oldest.size() < kSamples) seen.oldest.emplace_back(bytes.begin(), bytes.end());
  seen.newest.emplace_back(bytes.begin(), bytes.end());
  if (seen.newest.size() > kSamples) seen.newest.pop_front();
  if (channel != "HEALTH") return;
  // link passes forged ones on, which judge() forgets.
  if (const auto health = decode_checked<health_t>(bytes)) health_[health->process] = *health;
}

// All inputs, from what the processes declare. What link passes on unread has the type of what is
// sent there.
void Attack::choose_targets() {
  for (const std::string& name : arena_.processes()) {
    if (options_.process != "all" && options_.process != name) continue;
    for (const PortRecord& port : arena_.world().node(name).ports()) {
      const PortSpec& spec = port.spec;
      if (!port.is_input || (is_obeyed(spec.channel) && !options_.orders)) continue;
      if (!options_.channel.empty() && options_.channel != spec.channel) continue;
      const MessageSchema* schema = find_schema(port.type);
      const Seen& seen = seen_[{spec.domain, spec.channel}];
      if (schema == nullptr && !seen.newest.empty()) schema = identify_message(seen.newest.front());
      if (schema != nullptr) targets_.push_back({spec.domain, spec.channel, schema});
    }
  }
  if (targets_.empty()) throw UsageError("no such process, or it has no such input");
}

const std::vector<uint8_t>& Attack::sample(const Target& target) {
  Seen& seen = seen_[{target.domain, target.channel}];
  if (seen.newest.empty()) {
    seen.newest.push_back(mutator_.invent(*target.schema, arena_.world().now()));
    seen.oldest = seen.newest;
  }
  const auto& samples = random_() % 4 == 0 ? seen.oldest : seen.newest;
  return samples[random_() % samples.size()];
}

void Attack::throw_one(Progress* progress) {
  const Target& target = targets_[random_() % targets_.size()];
  Simulation& world = arena_.world();
  Mutant mutant = mutator_.mutate(*target.schema, sample(target), world.now());
  std::snprintf(progress->last, sizeof progress->last, "%s, %s: %s", to_string(target.domain),
                target.channel.c_str(), mutant.what.c_str());
  ++progress->thrown;
  progress->refused_at_the_border += mutant.must_be_refused ? 1 : 0;
  Thrown thrown{world.now(),
                target.domain,
                target.channel,
                options_.process == "all" ? "" : options_.process,
                std::move(mutant.what),
                std::move(mutant.bytes)};
  if (options_.tape != nullptr) options_.tape->append(thrown);
  world.inject(thrown.time, thrown.domain, thrown.channel, std::move(thrown.bytes),
               thrown.only_for);
}

// Of those that were thrown before.
void Attack::throw_due(size_t* next, Progress* progress) {
  Simulation& world = arena_.world();
  const std::vector<Thrown>& again = *options_.throw_again;
  for (; *next < again.size() && again[*next].time <= world.now(); ++*next, ++progress->thrown) {
    const Thrown& t = again[*next];
    world.inject(t.time, t.domain, t.channel, t.bytes, t.only_for);
  }
}

void Attack::throw_all(Progress* progress) {
  const auto bursts = static_cast<int64_t>(options_.duration_s / kBurst_s);
  size_t next = 0;
  for (int64_t i = 0; i < bursts; ++i) {
    if (options_.throw_again != nullptr) throw_due(&next, progress);
    while (options_.throw_again == nullptr &&
           progress->thrown < options_.mutants * (i + 1) / bursts)
      throw_one(progress);
    arena_.run_for(kBurst_s);
  }
}

std::string Attack::judge_function() {
  arena_.begin_judging();
  arena_.run_for(kJudged_s);
  return arena_.find_fault();
}

// Everybody was OK before, and must be again.
std::string Attack::judge_health() {
  health_.clear();
  arena_.run_for(kJudged_s);
  std::string text;
  for (const std::string& name : arena_.processes()) {
    const health_t& health = health_[name];
    if (health.state == health_t::STATE_OK) continue;
    text += (text.empty() ? "" : "; ") + name + " is in state " + std::to_string(health.state) +
            ": " + health.reason;
  }
  return text;
}

std::string Attack::run(Progress* progress) {
  arena_.run_for(arena_.warm_up_s());
  if (const std::string fault = judge_function() + judge_health(); !fault.empty()) {
    return "before the attack: " + fault;
  }
  choose_targets();
  const double before_mb = heap_mb();
  progress->rss_before_mb = rss_mb();
  throw_all(progress);
  arena_.run_for(kRecovery_s);
  const std::string fault = judge_function();
  arena_.run_for(kHealthRecovery_s);
  const std::string health = judge_health();
  const double growth_mb = heap_mb() - before_mb;
  progress->rss_after_mb = rss_mb();
  if (growth_mb > kMaxGrowth_mb) return "the heap grew by " + std::to_string(growth_mb) + " MB";
  if (options_.orders) return {};
  const std::string later = health.empty() ? "" : "eight seconds after the last: " + health;
  if (fault.empty()) return later;
  return "two seconds after the last: " + fault + (later.empty() ? "" : "; " + later);
}

}  // namespace foresight::fuzz
