#include "common/simulation.h"

#include <algorithm>

#include "common/check.h"

namespace foresight {

// One process's view of the simulation.
class Simulation::ProcessHost : public Host {
 public:
  ProcessHost(Simulation* world, int owner) : world_(world), owner_(owner) {}

  int owner() const { return owner_; }
  Time now() const override { return world_->now_; }
  bool is_simulated() const override { return true; }
  void publish(Domain domain, const std::string& channel, std::span<const uint8_t> bytes) override {
    auto copy = std::make_shared<const std::vector<uint8_t>>(bytes.begin(), bytes.end());
    if (world_->tap_) world_->tap_(world_->now_, domain, channel, bytes);
    world_->schedule(world_->now_, 0, [world = world_, domain, channel, copy] {
      world->deliver(domain, channel, copy);
    });
  }
  void subscribe(Domain domain, const std::string& channel, Queue, int64_t*,
                 Handler handler) override {
    world_->subscriptions_.push_back(
        std::make_shared<Subscription>(Subscription{owner_, domain, channel, std::move(handler)}));
  }
  void call_every(Duration period, std::function<void()> call) override {
    tick(std::make_shared<std::function<void()>>(std::move(call)), period, world_->now_ + period);
  }
  void call_at(Time time, std::function<void()> call) override {
    world_->schedule(std::max(time, world_->now_), owner_, std::move(call));
  }
  void run_job(Job job, Duration simulated_cost) override {
    world_->schedule(world_->now_ + simulated_cost, owner_, job());
  }
  void stop(int) override { world_->stopped_ = true; }

 private:
  void tick(std::shared_ptr<std::function<void()>> call, Duration period, Time due) {
    world_->schedule(due, owner_, [this, call, period, due] {
      tick(call, period, due + period);
      (*call)();
    });
  }
  Simulation* world_;
  int owner_;
};

Simulation::Simulation(Time start) : now_(start) {}
Simulation::~Simulation() = default;

Process& Simulation::add(const std::string& name, std::vector<Domain> health_domains,
                         const Factory& factory) {
  FORESIGHT_CHECK(!members_.contains(name));
  Member& member = members_[name];
  const int owner = next_owner_++;
  alive_[owner] = name;
  member.host = std::make_unique<ProcessHost>(this, owner);
  member.node = std::make_unique<Node>(name, *member.host, std::move(health_domains));
  member.process = factory(*member.node);
  member.process->start();
  return *member.process;
}

void Simulation::remove(const std::string& name) {
  const auto found = members_.find(name);
  FORESIGHT_CHECK(found != members_.end());
  const int owner = found->second.host->owner();
  alive_.erase(owner);
  std::erase_if(subscriptions_, [&](const auto& s) { return s->owner == owner; });
  members_.erase(found);
}

const Node& Simulation::node(const std::string& name) const { return *members_.at(name).node; }

void Simulation::schedule(Time time, int owner, std::function<void()> call) {
  events_.push({time, order_++, owner, std::make_shared<std::function<void()>>(std::move(call))});
}

void Simulation::call_at(Time time, std::function<void()> call) {
  schedule(std::max(time, now_), 0, std::move(call));
}

void Simulation::inject(Time time, Domain domain, const std::string& channel,
                        std::vector<uint8_t> bytes, const std::string& only_for) {
  auto shared = std::make_shared<const std::vector<uint8_t>>(std::move(bytes));
  schedule(std::max(time, now_), 0, [this, domain, channel, shared, only_for] {
    deliver(domain, channel, shared, only_for);
  });
}

void Simulation::listen(Domain domain, const std::string& channel, Host::Handler handler) {
  subscriptions_.push_back(
      std::make_shared<Subscription>(Subscription{0, domain, channel, std::move(handler)}));
}

void Simulation::deliver(Domain domain, const std::string& channel,
                         const std::shared_ptr<const std::vector<uint8_t>>& bytes,
                         const std::string& only_for) {
  const auto subscriptions = subscriptions_;  // a handler may add or remove some
  for (const auto& s : subscriptions) {
    if (!only_for.empty() && (!alive_.contains(s->owner) || alive_.at(s->owner) != only_for)) {
      continue;
    }
    if (s->domain == domain && s->channel == channel && is_alive(s->owner)) s->handler(*bytes);
  }
}

void Simulation::run_until(Time time) {
  while (!events_.empty() && events_.top().time <= time) {
    const Event event = events_.top();
    events_.pop();
    now_ = event.time;
    if (is_alive(event.owner)) (*event.call)();
  }
  now_ = std::max(now_, time);
}

}  // namespace foresight
