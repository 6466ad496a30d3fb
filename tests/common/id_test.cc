#include "common/id.h"

#include <gtest/gtest.h>

#include <unordered_set>

#include "tests/common/id_concepts.h"

namespace foresight {
namespace {

using RedId = Id<struct RedTag>;
using BlueId = Id<struct BlueTag>;

// What must not compile.
static_assert(IndexedBy<IdVector<RedId, int>, RedId>);
static_assert(!IndexedBy<IdVector<RedId, int>, BlueId>);
static_assert(!IndexedBy<IdVector<RedId, int>, int>);
static_assert(!IndexedBy<std::vector<int>, RedId>);
static_assert(!std::is_convertible_v<int, RedId>);
static_assert(!std::is_convertible_v<RedId, int>);
static_assert(!std::is_constructible_v<RedId, BlueId>);
static_assert(!std::is_assignable_v<RedId&, BlueId>);
static_assert(!std::is_assignable_v<RedId&, int>);
static_assert(ComparableWith<RedId, RedId>);
static_assert(!ComparableWith<RedId, BlueId>);
static_assert(!ComparableWith<RedId, int>);
static_assert(!AddableTo<RedId, int>);
static_assert(!std::is_same_v<KeyframeId, PointId>);

TEST(Id, TheDefaultOneIsNone) {
  EXPECT_FALSE(RedId().is_valid());
  EXPECT_TRUE(RedId(0).is_valid());
  const IdVector<RedId, int> two(2);
  EXPECT_FALSE(two.contains(RedId()));
  EXPECT_TRUE(two.contains(RedId(1)));
  EXPECT_FALSE(two.contains(RedId(2)));
}

TEST(Id, NamesWhatWasPushed) {
  IdVector<RedId, char> letters;
  const RedId a = letters.push_back('a');
  const RedId b = letters.emplace_back('b');
  EXPECT_EQ(letters[a], 'a');
  EXPECT_EQ(letters[b], 'b');
  EXPECT_EQ(b, a.next());
  EXPECT_EQ(letters.limit(), b.next());
  letters[a] = 'c';
  std::string all;
  for (const RedId id : letters.ids()) all += letters[id];
  EXPECT_EQ(all, "cb");
}

TEST(Id, AVectorGrowsToWhatIsNamed) {
  IdVector<BlueId, bool> flags;
  flags.grow_to(BlueId(4), false);
  EXPECT_EQ(flags.size(), 5u);
  flags[BlueId(4)] = true;
  flags.grow_to(BlueId(2), false);
  EXPECT_EQ(flags.size(), 5u);
  EXPECT_TRUE(flags[BlueId(4)]);
}

TEST(Id, IsAKeyAndHasAnOrder) {
  std::unordered_set<RedId> some{RedId(3), RedId(4), RedId(3)};
  EXPECT_EQ(some.size(), 2u);
  EXPECT_LT(RedId(3), RedId(4));
}

}  // namespace
}  // namespace foresight
