// Absurd but well-formed messages: whatever is thrown at a process, nobody dies, no memory grows,
// and two seconds after the last one everything is as before. More of it: message-fuzz.
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <set>

#include "common/live_host.h"
#include "common/messages.h"
#include "foresight/sim_clock_t.hpp"
#include "tests/common/all_messages.h"
#include "tests/fuzz/robot_line.h"
#include "tests/fuzz/shrinker.h"

namespace foresight::fuzz {
namespace {

constexpr Time kNow{1'700'000'000'000'000};

TEST(Mutator, TakesEveryMessageApartAndPutsItTogether) {
  std::mt19937_64 random(1);
  for (const MessageSchema* schema : all_schemas()) {
    for (int i = 0; i < 50; ++i) {
      const auto bytes = write_record(*schema, random_record(*schema, random));
      ASSERT_EQ(find_layout_error(*schema, bytes), "");
      ASSERT_EQ(write_record(*schema, read_record(*schema, bytes)), bytes) << schema->name;
    }
  }
}

// What the border lets pass can be decoded, and every field of every message is tried.
TEST(Mutator, ItsMessagesAreWellFormedOrRefusedAtTheBorder) {
  for_each_message(AllMessages{}, []<class Message>() {
    const MessageSchema& schema = *find_schema(Message::getTypeName());
    Mutator mutator(7);
    const auto genuine = mutator.invent(schema, kNow);
    std::set<std::vector<uint8_t>> different;
    int refused = 0;
    for (int i = 0; i < 2000; ++i) {
      const Mutant mutant = mutator.mutate(schema, genuine, kNow);
      different.insert(mutant.bytes);
      refused += mutant.must_be_refused ? 1 : 0;
      if (mutant.must_be_refused) continue;
      Message message;
      ASSERT_EQ(message.decode(mutant.bytes.data(), 0, static_cast<int>(mutant.bytes.size())),
                static_cast<int>(mutant.bytes.size()))
          << mutant.what;
    }
    EXPECT_GT(different.size(), 30u) << schema.name;
    EXPECT_LT(refused, 1500) << schema.name << ": too wild";
  });
}

TEST(Mutator, TheSameSeedMakesTheSameMessages) {
  const MessageSchema& schema = *find_schema("joint_state_t");
  Mutator a(3), b(3);
  const auto genuine = a.invent(schema, kNow);
  ASSERT_EQ(genuine, b.invent(schema, kNow));
  for (int i = 0; i < 100; ++i) {
    ASSERT_EQ(a.mutate(schema, genuine, kNow).bytes, b.mutate(schema, genuine, kNow).bytes);
  }
}

TEST(Shrinker, FindsTheFewThatMatter) {
  for (const std::vector<size_t>& culprits :
       {std::vector<size_t>{0}, {999}, {17, 500}, {1, 2, 3, 800, 801}}) {
    int questions = 0;
    const auto fails = [&](const std::vector<size_t>& some) {
      ++questions;
      return std::includes(some.begin(), some.end(), culprits.begin(), culprits.end());
    };
    EXPECT_EQ(shrink(1000, fails, [] { return false; }), culprits);
    EXPECT_LT(questions, 30 * static_cast<int>(culprits.size()) + 30);
  }
}

TEST(Shrinker, WhatIsLeftWhenTheTimeIsOverStillFails) {
  int questions = 0;
  const auto fails = [&](const std::vector<size_t>& some) {
    ++questions;
    return std::find(some.begin(), some.end(), 700u) != some.end();
  };
  const auto left = shrink(1000, fails, [&] { return questions >= 4; });
  EXPECT_TRUE(fails(left));
  EXPECT_LT(left.size(), 1000u);
}

// A round from its tape is the round: the same fault, or none, and as many messages.
TEST(Tape, ThrowsTheSameAgain) {
  Tape tape(size_t{1} << 28);
  std::vector<std::string> said[2];
  const auto round = [&](AttackOptions options, std::vector<std::string>* poses) {
    RobotLine arena;
    Progress progress;
    Attack attack(arena, options);
    arena.world().listen(Domain::kRobot, "BASE_POSE", [poses](std::span<const uint8_t> bytes) {
      poses->emplace_back(bytes.begin(), bytes.end());
    });
    EXPECT_EQ(attack.run(&progress), "") << progress.last;
    EXPECT_EQ(progress.thrown, 2000);
  };
  round({.process = "calibrator", .seed = 3, .mutants = 2000, .tape = &tape}, &said[0]);
  const std::vector<Thrown> all = tape.read();
  ASSERT_EQ(all.size(), 2000u);
  round({.process = "calibrator", .seed = 4, .throw_again = &all}, &said[1]);
  EXPECT_FALSE(said[0].empty());
  EXPECT_EQ(said[0], said[1]);
}

// CLOCK is heard by the host and not by a port, so it has a fire of its own: twenty absurd ones for
// each of a world's, which goes on at 500 Hz for four seconds.
TEST(ClockUnderFire, IsTheWorldsAgainATenthOfASecondAfterTheLast) {
  const MessageSchema& schema = *find_schema("sim_clock_t");
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    Mutator mutator(seed);
    PublishedClock clock;
    Time world = kNow;
    int64_t here_us = 50'000'000;
    std::deque<std::vector<uint8_t>> said;
    double furthest_s = 0;
    const auto go_on = [&](double for_s, int mutants) {
      for (int tick = 0; tick < for_s * 500; ++tick) {
        here_us += 2000;
        world = world + milliseconds(2);
        said.push_back(encode(sim_clock_t{world.us}));
        if (said.size() > 2000) said.pop_front();
        clock.on_message(said.back(), here_us);
        for (int i = 0; i < mutants; ++i) {
          const auto& sample = i % 4 == 0 ? said.front() : said.back();
          clock.on_message(mutator.mutate(schema, sample, world).bytes, here_us + i);
        }
        const double off_s = std::abs((clock.now({}, here_us + mutants) - world).seconds());
        furthest_s = std::max(furthest_s, off_s);
      }
    };
    go_on(1, 0);
    go_on(4, 20);
    EXPECT_LT(furthest_s, 0.02) << seed;
    go_on(0.1, 0);
    furthest_s = 0;
    go_on(4, 0);
    EXPECT_EQ(furthest_s, 0) << seed;
    EXPECT_FALSE(clock.is_disputed(here_us));
  }
}

class UnderFire : public testing::TestWithParam<const char*> {};

TEST_P(UnderFire, EverythingIsAsBeforeTwoSecondsAfterTheLast) {
  Progress progress;
  RobotLine arena;
  Attack attack(arena, {.process = GetParam(), .seed = 1, .mutants = 25'000});
  EXPECT_EQ(attack.run(&progress), "") << progress.last;
  EXPECT_EQ(progress.thrown, 25'000);
}

INSTANTIATE_TEST_SUITE_P(Processes, UnderFire,
                         testing::Values("carver", "mesher", "calibrator", "all"),
                         [](const auto& param_info) { return std::string(param_info.param); });

}  // namespace
}  // namespace foresight::fuzz
