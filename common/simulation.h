// Many processes in one thread on one simulated clock, without a network: for tests, for
// evaluation, and for the replay of logs. Everything happens in one order that depends on the
// inputs alone, so two runs give the same bytes.
//
//   Simulation world(Time{0});
//   world.add("slam", {Domain::kRobot}, [&](Node& node) {
//     return std::make_unique<SlamProcess>(node, params); });
//   world.run_until(Time{1'000'000});
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <queue>
#include <string>
#include <vector>

#include "common/host.h"
#include "common/node.h"

namespace foresight {

class Simulation {
 public:
  /// Sees every message as it is published.
  using Tap =
      std::function<void(Time, Domain, const std::string& channel, std::span<const uint8_t> bytes)>;
  using Factory = std::function<std::unique_ptr<Process>(Node&)>;

  explicit Simulation(Time start);
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  /// Constructs and starts a process.
  Process& add(const std::string& name, std::vector<Domain> health_domains, const Factory& factory);
  /// Removes a process as SIGKILL would: its timers, jobs and subscriptions are gone.
  void remove(const std::string& name);
  const Node& node(const std::string& name) const;

  Time now() const { return now_; }
  void set_tap(Tap tap) { tap_ = std::move(tap); }
  /// Publishes bytes from outside (a log, a test) at a time that is not in the past; `only_for`:
  /// one process gets them, and nobody else.
  void inject(Time time, Domain domain, const std::string& channel, std::vector<uint8_t> bytes,
              const std::string& only_for = {});
  /// A direct subscription, for tests and evaluation.
  void listen(Domain domain, const std::string& channel, Host::Handler handler);
  void call_at(Time time, std::function<void()> call);

  /// Runs everything that is due up to and including `time`.
  void run_until(Time time);
  /// Set when a process asked to end (camera at the end of its source, say).
  bool is_stopped() const { return stopped_; }

 private:
  class ProcessHost;
  struct Member {
    std::unique_ptr<ProcessHost> host;
    std::unique_ptr<Node> node;
    std::unique_ptr<Process> process;
  };
  struct Subscription {
    int owner;  // 0: outside
    Domain domain;
    std::string channel;
    Host::Handler handler;
  };
  struct Event {
    Time time;
    int64_t order;
    int owner;
    std::shared_ptr<std::function<void()>> call;
    bool operator>(const Event& o) const {
      return time != o.time ? time > o.time : order > o.order;
    }
  };

  void schedule(Time time, int owner, std::function<void()> call);
  void deliver(Domain domain, const std::string& channel,
               const std::shared_ptr<const std::vector<uint8_t>>& bytes,
               const std::string& only_for = {});
  bool is_alive(int owner) const { return owner == 0 || alive_.contains(owner); }

  Time now_;
  int64_t order_ = 0;
  int next_owner_ = 1;
  bool stopped_ = false;
  std::map<int, std::string> alive_;
  std::map<std::string, Member> members_;
  std::vector<std::shared_ptr<Subscription>> subscriptions_;
  std::priority_queue<Event, std::vector<Event>, std::greater<>> events_;
  Tap tap_;
};

}  // namespace foresight
