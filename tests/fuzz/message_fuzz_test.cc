// Absurd but well-formed messages: whatever is thrown at a process, nobody dies, no memory grows,
// and two seconds after the last one everything is as before. More of it: message-fuzz.
#include <gtest/gtest.h>

#include <set>

#include "tests/common/all_messages.h"
#include "tests/fuzz/robot_line.h"

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
