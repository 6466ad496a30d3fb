// Random event sequences: after every delta the receiver's cells equal a brute-force carving.
#include <gtest/gtest.h>

#include "procs/carver/carver.h"
#include "tests/carver/brute_force.h"

namespace foresight::carver_test {
namespace {

struct Case {
  Layout layout;
  uint32_t seed;
  double rebuild_cost_ratio;
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << "layout " << static_cast<int>(c.layout) << ", seed " << c.seed << ", rebuild ratio "
       << c.rebuild_cost_ratio;
}

// A carver and what it makes of a generator's deltas, compared with the truth after each.
class Follower {
 public:
  explicit Follower(const Case& c) : carver(with_ratio(c.rebuild_cost_ratio)) {}

  void follow(const MapDelta& delta, const MapModel& model) {
    ASSERT_EQ(receiver.apply(carver.apply(delta)), "");
    const CarverStatistics s = carver.statistics();
    ASSERT_EQ(s.points, static_cast<int64_t>(model.points.size()));
    ASSERT_EQ(s.keyframes, static_cast<int64_t>(model.cameras.size()));
    ASSERT_EQ(s.constraints, static_cast<int64_t>(model.observations.size()));
    if (receiver.cells().empty()) return;
    const Carving expected = carve_by_brute_force(model, receiver.vertices());
    ASSERT_EQ(differences(receiver.carving(), expected), "");
    ASSERT_EQ(differences(receiver.evidence(), model), "");
    ASSERT_EQ(s.cells, static_cast<int64_t>(expected.size()));
  }

  void start_over() {
    carver.reset();
    receiver = {};
  }

  Carver carver;
  Receiver receiver;

 private:
  static CarverOptions with_ratio(double ratio) {
    CarverOptions options;
    options.rebuild_cost_ratio = ratio;
    return options;
  }
};

class RandomMap : public testing::TestWithParam<Case> {};

TEST_P(RandomMap, EveryDeltaEqualsBruteForce) {
  MapGenerator generator(GetParam().layout, GetParam().seed);
  Follower follower(GetParam());
  for (int step = 0; step < 30; ++step) {
    SCOPED_TRACE(step);
    const MapDelta delta = generator.next();
    ASSERT_NO_FATAL_FAILURE(follower.follow(delta, generator.model()));
    if (step % 10 == 9) {
      ASSERT_EQ(follower.carver.validate(), "");
    }
  }
  Receiver late;
  ASSERT_EQ(late.apply(follower.carver.snapshot()), "");
  EXPECT_EQ(late.carving(), follower.receiver.carving());
  EXPECT_EQ(late.evidence(), follower.receiver.evidence());
}

// Closed loops, bursts, everything removed, bad input, and a new epoch in the middle.
TEST_P(RandomMap, GreatChangesEqualBruteForce) {
  MapGenerator generator(GetParam().layout, GetParam().seed);
  Follower follower(GetParam());
  const auto next = [&](int step) {
    if (step % 6 == 5) return generator.close_loop();
    if (step % 6 == 3) return generator.next_hostile();
    if (step % 12 == 0) return generator.grow_much();
    return step % 12 == 10 ? generator.remove_all() : generator.next();
  };
  for (int step = 0; step < 24; ++step) {
    SCOPED_TRACE(step);
    if (step == 14) {
      generator.start_over();
      follower.start_over();
    }
    const MapDelta delta = next(step);
    ASSERT_NO_FATAL_FAILURE(follower.follow(delta, generator.model()));
  }
  EXPECT_EQ(follower.carver.validate(), "");
}

std::vector<Case> all_cases() {
  std::vector<Case> cases;
  for (const Layout layout : kAllLayouts) {
    for (uint32_t seed = 1; seed <= 3; ++seed) cases.push_back({layout, seed, 1e9});
    cases.push_back({layout, 11, 1.0});
    cases.push_back({layout, 12, 0.0});
  }
  return cases;
}

INSTANTIATE_TEST_SUITE_P(Layouts, RandomMap, testing::ValuesIn(all_cases()));

// Fewer constraints per cell: never a wrong one, never more than K; fewer cells carved at most.
TEST(BoundedLists, AreSubsetsOfTheTruth) {
  for (const Layout layout : {Layout::kGeneral, Layout::kLattice}) {
    MapGenerator generator(layout, 5);
    CarverOptions options;
    options.max_constraints_per_cell = 3;
    options.rebuild_cost_ratio = 1e9;
    Carver carver(options);
    Receiver receiver;
    for (int step = 0; step < 30; ++step) {
      ASSERT_EQ(receiver.apply(carver.apply(generator.next())), "");
      if (step % 5 == 4) {
        ASSERT_EQ(carver.validate(), "") << "step " << step;
      }
    }
    EXPECT_GT(carver.statistics().carved_cells, 0);
    EXPECT_LE(carver.statistics().max_constraints_in_cell, 3);
  }
}

TEST(Determinism, SameDeltasSameOutput) {
  for (const Layout layout : {Layout::kGeneral, Layout::kLattice}) {
    MapGenerator first(layout, 3), second(layout, 3);
    Carver a, b;
    for (int step = 0; step < 30; ++step) {
      const CarvingDelta x = a.apply(first.next()), y = b.apply(second.next());
      ASSERT_EQ(x.cells_removed, y.cells_removed);
      ASSERT_EQ(x.vertices_removed, y.vertices_removed);
      ASSERT_EQ(x.cells_added.size(), y.cells_added.size());
      for (size_t n = 0; n < x.cells_added.size(); ++n) {
        ASSERT_EQ(x.cells_added[n].id, y.cells_added[n].id);
        ASSERT_EQ(x.cells_added[n].vertices, y.cells_added[n].vertices);
      }
    }
  }
}

}  // namespace
}  // namespace foresight::carver_test
