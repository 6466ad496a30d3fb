#include "common/simulation.h"

#include <gtest/gtest.h>

#include <random>

#include "foresight/snapshot_request_t.hpp"

namespace foresight {
namespace {

// Answers each message with one of its own, after a random time, and sometimes by a job.
class Chatterer : public Process {
 public:
  Chatterer(Node& node, const std::string& in, const std::string& out, uint32_t seed)
      : node_(node), random_(seed), out_(node.advertise<snapshot_request_t>({.channel = out})) {
    node.subscribe<snapshot_request_t>({.channel = in}, Queue::kAll,
                                       [this](const snapshot_request_t& m) { answer(m.utime); });
    node.every(milliseconds(7), "spontaneous", [this] { answer(0); });
  }

 private:
  void answer(int64_t utime) {
    if (random_() % 3 == 0) {
      static_cast<void>(node_.run_beside(
          [this, utime]() -> std::function<void()> { return [this, utime] { send(utime + 1); }; },
          milliseconds(random_() % 20)));
    } else {
      node_.at(node_.now() + milliseconds(random_() % 20), [this, utime] { send(utime + 1); });
    }
  }
  void send(int64_t utime) {
    if (utime > 5) return;  // chains end
    snapshot_request_t m{};
    m.utime = utime;
    m.requester = node_.name();
    out_.publish(m);
  }
  Node& node_;
  std::mt19937 random_;
  Publisher<snapshot_request_t> out_;
};

void add_chatterer(Simulation* world, const std::string& name, const std::string& in,
                   const std::string& out, uint32_t seed) {
  world->add(name, {Domain::kRobot},
             [=](Node& node) { return std::make_unique<Chatterer>(node, in, out, seed); });
}

// Everything that was published, as one string.
std::string run_world(uint32_t seed, bool with_restart) {
  Simulation world(Time{1'000'000});
  std::string record;
  world.set_tap([&](Time time, Domain, const std::string& channel, auto bytes) {
    record += std::to_string(time.us) + channel + std::string(bytes.begin(), bytes.end());
  });
  add_chatterer(&world, "a", "X", "Y", seed);
  add_chatterer(&world, "b", "Y", "X", seed + 1);
  world.run_until(Time{3'000'000});
  if (with_restart) {
    world.remove("b");
    world.run_until(Time{3'500'000});
    add_chatterer(&world, "b", "Y", "X", seed + 2);
  }
  world.run_until(Time{6'000'000});
  return record;
}

TEST(Simulation, TheSameRunGivesTheSameBytes) {
  for (const bool with_restart : {false, true}) {
    const std::string once = run_world(1, with_restart);
    EXPECT_GT(once.size(), 10'000u);
    EXPECT_EQ(once, run_world(1, with_restart));
    EXPECT_NE(once, run_world(2, with_restart));
  }
}

TEST(Simulation, ARemovedProcessIsSilent) {
  Simulation world(Time{0});
  add_chatterer(&world, "a", "X", "Y", 1);
  world.run_until(Time{500'000});
  world.remove("a");
  int messages = 0;
  world.set_tap([&](Time, Domain, const std::string&, auto) { ++messages; });
  world.inject(world.now(), Domain::kRobot, "X", {1, 2, 3});
  world.run_until(Time{2'000'000});
  EXPECT_EQ(messages, 0);
}

TEST(Simulation, KeepsTheOrderOfEventsOfOneInstant) {
  Simulation world(Time{0});
  std::string order;
  world.call_at(Time{5}, [&] { order += "b"; });
  world.call_at(Time{4}, [&] { order += "a"; });
  world.call_at(Time{5}, [&] { order += "c"; });
  world.run_until(Time{4});
  EXPECT_EQ(order, "a");
  world.run_until(Time{5});
  EXPECT_EQ(order, "abc");
  EXPECT_EQ(world.now(), Time{5});
}

TEST(Simulation, KeepsTheDomainsApart) {
  Simulation world(Time{0});
  int robot = 0, operators = 0;
  world.listen(Domain::kRobot, "X", [&](auto) { ++robot; });
  world.listen(Domain::kOperator, "X", [&](auto) { ++operators; });
  world.inject(Time{1}, Domain::kOperator, "X", {1});
  world.run_until(Time{2});
  EXPECT_EQ(robot, 0);
  EXPECT_EQ(operators, 1);
}

class Ending : public Process {
 public:
  explicit Ending(Node& node) : node_(node) {}
  void start() override {
    node_.at(node_.now() + milliseconds(3), [this] { node_.finish("all done", kExitDone); });
  }

 private:
  Node& node_;
};

TEST(Simulation, SaysWhenAProcessAsksToEnd) {
  Simulation world(Time{0});
  world.add("p", {}, [](Node& node) { return std::make_unique<Ending>(node); });
  world.run_until(Time{2'000});
  EXPECT_FALSE(world.is_stopped());
  world.run_until(Time{4'000});
  EXPECT_TRUE(world.is_stopped());
  EXPECT_EQ(world.node("p").state(), ProcessState::kDone);
}

}  // namespace
}  // namespace foresight
