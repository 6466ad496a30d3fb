// What the compiler refuses in the mesher: a slot taken for a cell, a place taken for a vertex's
// id.
#include <gtest/gtest.h>

#include <type_traits>

#include "procs/mesher/mesher.h"
#include "tests/common/id_concepts.h"

namespace foresight {
namespace {

using Carved = std::remove_cvref_t<decltype(std::declval<const Mesher&>().carved())>;

static_assert(IndexedBy<Carved, CellId>);
static_assert(!IndexedBy<Carved, Slot>);
static_assert(!IndexedBy<Carved, MaxFlow::NodeId>);
static_assert(!IndexedBy<Carved, int>);
static_assert(!ComparableWith<CellId, Slot>);
static_assert(!ComparableWith<CellId, MaxFlow::NodeId>);
static_assert(!ComparableWith<Slot, MaxFlow::ArcId>);
static_assert(!ComparableWith<VertexIndex, VertexId>);

template <class A>
concept HasVolume = requires(const CellComplex c, A a) {
  c.volume(a);
};
template <class A>
concept HasTwin = requires(const CellComplex c, A a) {
  c.twin(a);
};
template <class A>
concept HasPosition = requires(const CellComplex c, A a) {
  c.position_in_map(a);
};
template <class A>
concept HasFlowSide = requires(const MaxFlow f, A a) {
  f.side(a);
};
template <class A>
concept HasFlowTwin = requires(const MaxFlow f, A a) {
  f.twin(a);
};
static_assert(HasVolume<CellId> && !HasVolume<Slot> && !HasVolume<int>);
static_assert(HasTwin<Slot> && !HasTwin<CellId> && !HasTwin<int>);
static_assert(HasPosition<VertexIndex> && !HasPosition<VertexId> && !HasPosition<Slot>);
static_assert(HasFlowSide<MaxFlow::NodeId> && !HasFlowSide<CellId> && !HasFlowSide<int>);
static_assert(HasFlowTwin<MaxFlow::ArcId> && !HasFlowTwin<Slot> && !HasFlowTwin<MaxFlow::NodeId>);

TEST(MesherIds, ASlotIsACornerOfACell) {
  for (const int32_t cell : {0, 1, 12345}) {
    int32_t corner = 0;
    for (const Slot slot : slots_of(CellId(cell))) {
      EXPECT_EQ(slot, slot_of(CellId(cell), corner));
      EXPECT_EQ(cell_of(slot), CellId(cell));
      EXPECT_EQ(corner_of(slot), corner++);
    }
    EXPECT_EQ(corner, 4);
  }
}

TEST(MesherIds, ATableKnowsCornersPointsAndFarIds) {
  VertexTable table;
  const VertexId far(2'000'000'000);
  table.insert(VertexId::hull_corner(7), VertexIndex(3));
  table.insert(VertexId(PointId(0)), VertexIndex(4));
  table.insert(far, VertexIndex(5));
  EXPECT_EQ(table.find(VertexId::hull_corner(7)), VertexIndex(3));
  EXPECT_EQ(table.find(VertexId(0)), VertexIndex(4));
  EXPECT_EQ(table.find(far), VertexIndex(5));
  EXPECT_FALSE(table.find(VertexId::hull_corner(6)).is_valid());
  EXPECT_FALSE(table.find(VertexId()).is_valid());
  table.erase(far);
  EXPECT_FALSE(table.find(far).is_valid());
  EXPECT_EQ(table.size(), 2);
}

}  // namespace
}  // namespace foresight
