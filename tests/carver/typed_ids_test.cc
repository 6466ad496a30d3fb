// What the compiler refuses in the carver: a constraint taken for a cell, a place taken for an id.
#include <gtest/gtest.h>

#include <type_traits>

#include "procs/carver/constraint_lists.h"
#include "procs/carver/delaunay.h"
#include "procs/carver/map_state.h"
#include "procs/carver/vertex_register.h"
#include "tests/common/id_concepts.h"

namespace foresight::carving {
namespace {

using Cells = decltype(Tetrahedra::cells);
using Positions = decltype(Tetrahedra::positions);
using Points = decltype(MapState::points);
using Keyframes = decltype(MapState::keyframes);
using Constraints = decltype(MapState::constraints);

static_assert(IndexedBy<Cells, CellId>);
static_assert(!IndexedBy<Cells, ConstraintIndex>);
static_assert(!IndexedBy<Cells, VertexIndex>);
static_assert(!IndexedBy<Cells, int>);
static_assert(IndexedBy<Positions, VertexIndex>);
static_assert(!IndexedBy<Positions, PointIndex>);
static_assert(!IndexedBy<Positions, VertexId>);
static_assert(IndexedBy<Points, PointIndex>);
static_assert(!IndexedBy<Points, PointId>, "slam's ids may have any gaps");
static_assert(!IndexedBy<Points, KeyframeIndex>);
static_assert(IndexedBy<Keyframes, KeyframeIndex>);
static_assert(!IndexedBy<Keyframes, KeyframeId>);
static_assert(IndexedBy<Constraints, ConstraintIndex>);
static_assert(!IndexedBy<Constraints, PointIndex>);

template <class A>
concept HasAList = requires(const ConstraintLists lists, A a) {
  lists.entries(a);
};
static_assert(HasAList<CellId>);
static_assert(!HasAList<ConstraintIndex>);
static_assert(!HasAList<int>);
static_assert(std::is_constructible_v<Entry, ConstraintIndex, uint32_t>);
static_assert(!std::is_constructible_v<Entry, CellId, uint32_t>);
static_assert(!std::is_constructible_v<Entry, uint32_t, ConstraintIndex>, "the two in their order");
static_assert(!std::is_constructible_v<VertexId, VertexIndex>, "the register knows its id");
static_assert(std::is_constructible_v<VertexId, PointId>);
static_assert(!ComparableWith<VertexId, PointId>);
static_assert(!ComparableWith<CellId, ConstraintIndex>);
static_assert(sizeof(Entry) == 4 && sizeof(Cell) == 32);

TEST(TypedIds, AnEntryKeepsConstraintAndCode) {
  for (const uint32_t code : {0U, 3U, kEntryStart, kEntryEnd, kEntryOther}) {
    for (const int32_t number : {0, 1, kMaxConstraints - 1}) {
      const Entry entry(ConstraintIndex(number), code);
      EXPECT_EQ(entry.constraint(), ConstraintIndex(number));
      EXPECT_EQ(entry.code(), code);
    }
  }
}

TEST(TypedIds, AVertexIdIsAPointOrOneOfEightCorners) {
  EXPECT_FALSE(VertexId().is_valid());
  EXPECT_FALSE(VertexId().is_point());
  EXPECT_TRUE(VertexId(PointId(0)).is_point());
  EXPECT_EQ(VertexId(PointId(7)), VertexId(7));
  EXPECT_EQ(VertexId::hull_corner(7), VertexId(-8));
  EXPECT_TRUE(VertexId::hull_corner(7).is_valid());
  EXPECT_FALSE(VertexId::hull_corner(7).is_point());
  EXPECT_FALSE(VertexId::hull_corner(8).is_valid());
}

}  // namespace
}  // namespace foresight::carving
