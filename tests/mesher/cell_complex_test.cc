#include "procs/mesher/cell_complex.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "procs/mesher/confidence.h"
#include "tests/common/plain_ids.h"
#include "tests/mesher/delaunay_carving.h"
#include "tests/mesher/mesher_checks.h"

namespace foresight {
namespace {

Eigen::Vector3f random_point(std::mt19937* random) {
  std::uniform_real_distribution<float> coordinate(-1, 1);
  const float x = coordinate(*random), y = coordinate(*random), z = coordinate(*random);
  return {x, y, z};
}

DelaunayCarving random_carving(int32_t points, uint32_t seed) {
  std::mt19937 random(seed);
  DelaunayCarving carving;
  carving.add_hull_corners(20);
  for (int32_t i = 0; i < points; ++i) carving.set_point(i, random_point(&random));
  carving.carve_at_random(0.4, seed);
  return carving;
}

void expect_valid(const CellComplex& complex) {
  const auto broken = complex.find_broken_invariant();
  EXPECT_FALSE(broken) << *broken;
}

CarvingDelta one_tetrahedron() {
  CarvingDelta delta;
  delta.vertices_set = vertices({{0, {0, 0, 0}}, {1, {1, 0, 0}}, {2, {0, 1, 0}}, {3, {0, 0, 1}}});
  delta.cells_added = cells({{0, {0, 1, 2, 3}, 1}});
  return delta;
}

TEST(CellComplex, OneTetrahedron) {
  CellComplex complex;
  ASSERT_EQ(complex.apply(one_tetrahedron()), ApplyResult::kOk);
  expect_valid(complex);
  EXPECT_EQ(complex.cell_count(), 1);
  EXPECT_EQ(complex.hull_facet_count(), 4);
  EXPECT_DOUBLE_EQ(complex.volume(CellId(0)), 1.0 / 6);
  EXPECT_DOUBLE_EQ(complex.area(Slot(1)), 0.5);
  EXPECT_DOUBLE_EQ(complex.area(Slot(0)), std::sqrt(3.0) / 2);
}

TEST(CellComplex, VolumesAddUpToTheHullAndTheHullHasTwelveFacets) {
  const DelaunayCarving carving = random_carving(500, 3);
  CellComplex complex;
  ASSERT_EQ(complex.apply(carving.snapshot()), ApplyResult::kOk);
  expect_valid(complex);
  double volume = 0;
  for (const CellId cell : complex.cells()) volume += complex.volume(cell);
  EXPECT_NEAR(volume, 40.0 * 40 * 40, 1e-6);
  EXPECT_EQ(complex.hull_facet_count(), 12);
}

/// Points come, go and move; counts change. After every delta the complex equals a fresh snapshot.
TEST(CellComplex, DeltasEqualFromScratch) {
  std::mt19937 random(5);
  DelaunayCarving carving;
  carving.add_hull_corners(20);
  CellComplex complex;
  for (int step = 0; step < 150; ++step) {
    for (int change = 0; change < 3; ++change) {
      const auto id = static_cast<int32_t>(random() % 60);
      const bool removes = random() % 4 == 0;
      removes ? carving.remove_point(id) : carving.set_point(id, random_point(&random));
    }
    carving.carve_at_random(0.4, static_cast<uint32_t>(step / 5));
    ASSERT_EQ(complex.apply(carving.take_delta()), ApplyResult::kOk) << "step " << step;
    expect_valid(complex);
    CellComplex fresh;
    ASSERT_EQ(fresh.apply(carving.snapshot()), ApplyResult::kOk);
    const ComplexContent now = content(complex), expected = content(fresh);
    ASSERT_EQ(now.size(), expected.size());
    for (const auto& [corners, cell] : expected) {
      const auto found = now.find(corners);
      ASSERT_NE(found, now.end());
      EXPECT_EQ(found->second.constraints, cell.constraints);
      EXPECT_EQ(found->second.votes, cell.votes);
      EXPECT_NEAR(found->second.volume, cell.volume, 1e-12 * cell.volume + 1e-15);
      EXPECT_EQ(found->second.neighbours, cell.neighbours);
    }
  }
}

TEST(CellComplex, RemovingEverythingLeavesNothing) {
  DelaunayCarving carving = random_carving(50, 7);
  CellComplex complex;
  const CarvingDelta snapshot = carving.snapshot();
  ASSERT_EQ(complex.apply(snapshot), ApplyResult::kOk);
  CarvingDelta removal;
  for (const auto& cell : snapshot.cells_added) removal.cells_removed.push_back(cell.id);
  for (const auto& vertex : snapshot.vertices_set) removal.vertices_removed.push_back(vertex.id);
  ASSERT_EQ(complex.apply(removal), ApplyResult::kOk);
  expect_valid(complex);
  EXPECT_EQ(complex.cell_count(), 0);
  EXPECT_EQ(complex.vertex_count(), 0);
  ASSERT_EQ(complex.apply(snapshot), ApplyResult::kOk);
  expect_valid(complex);
}

// ---- Hostile deltas -----------------------------------------------------------------------------

struct Hostile {
  const char* name;
  ApplyResult expected;
  std::function<void(CarvingDelta*)> write;
};

std::vector<Hostile> hostile_deltas() {
  using enum ApplyResult;
  constexpr int32_t kMax = std::numeric_limits<int32_t>::max();
  constexpr int32_t kMin = std::numeric_limits<int32_t>::min();
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  const auto remove = [](int32_t id) {
    return [id](CarvingDelta* d) { d->cells_removed.emplace_back(id); };
  };
  const auto add = [](int32_t id, std::array<int32_t, 4> v, int32_t n = 0) {
    return [=](CarvingDelta* d) { d->cells_added.push_back(carving_cell(id, v, n)); };
  };
  const auto set = [](int32_t id, Eigen::Vector3f p) {
    return [=](CarvingDelta* d) { d->vertices_set.push_back({VertexId(id), p}); };
  };
  const auto evidence = [](int32_t id, int32_t observations, float spread_rad) {
    return [=](CarvingDelta* d) {
      d->vertices_updated.push_back({VertexId(0), {3, 0.5f}});
      d->vertices_updated.push_back({VertexId(id), {observations, spread_rad}});
    };
  };
  const auto update = [](int32_t id, int32_t n) {
    return [=](CarvingDelta* d) { d->cells_updated.push_back({CellId(id), n}); };
  };
  return {
      {"remove unknown cell", kUnknownCell, remove(5000)},
      {"remove negative cell", kUnknownCell, remove(-1)},
      {"remove extreme cell", kUnknownCell, remove(kMin)},
      {"remove twice", kUnknownCell,
       [](CarvingDelta* d) {
         d->cells_removed = ids<CellId>({7, 7});
       }},
      {"remove unknown vertex", kUnknownVertex,
       [](auto* d) { d->vertices_removed = ids<VertexId>({12345}); }},
      {"remove used vertex", kVertexInUse,
       [](auto* d) { d->vertices_removed = ids<VertexId>({0}); }},
      {"set NaN", kBadPosition, set(900, {0, nan, 0})},
      {"set infinity", kBadPosition, set(900, {0, 0, inf})},
      {"set far below the corners", kVertexIdOutOfRange, set(kMin, {0, 0, 0})},
      {"move used vertex", kVertexInUse, set(0, {9, 9, 9})},
      {"evidence of unknown vertex", kUnknownVertex, evidence(12345, 1, 0)},
      {"negative observations", kBadEvidence, evidence(1, -1, 0)},
      {"negative spread", kBadEvidence, evidence(1, 2, -0.1f)},
      {"spread NaN", kBadEvidence, evidence(1, 2, nan)},
      {"spread beyond a half turn", kBadEvidence, evidence(1, 2, 3.2f)},
      {"new vertex with bad evidence", kBadEvidence,
       [nan](auto* d) {
         d->vertices_set.push_back({VertexId(900), {0, 0, 0}, {1, nan}});
       }},
      {"add existing cell", kDuplicateCell, add(3, {-1, -2, -3, -4})},
      {"add negative id", kCellIdOutOfRange, add(-1, {-1, -2, -3, -4})},
      {"add extreme id", kCellIdOutOfRange, add(kMax, {-1, -2, -3, -4})},
      {"add large id", kCellIdOutOfRange, add(1 << 20, {-1, -2, -3, -4})},
      {"add with unknown vertex", kUnknownVertex, add(2000, {0, 1, 2, 12345})},
      {"add with repeated vertex", kRepeatedVertex, add(2000, {0, 1, 1, 2})},
      {"add with negative count", kBadConstraints, add(2000, {0, 1, 2, 3}, -1)},
      {"update unknown cell", kUnknownCell, update(5000, 1)},
      {"update extreme cell", kUnknownCell, update(kMax, 1)},
      {"update with negative count", kBadConstraints, update(3, -5)},
  };
}

/// Each bad item comes after a lot of good ones, so that all of these have to be undone.
TEST(CellComplex, RejectsHostileDeltasAndStaysAsItWas) {
  for (const Hostile& hostile : hostile_deltas()) {
    DelaunayCarving carving = random_carving(60, 11);
    CellComplex complex;
    ASSERT_EQ(complex.apply(carving.take_delta()), ApplyResult::kOk);
    const ComplexContent before = content(complex);
    const CellId limit_before = complex.cell_limit();

    carving.remove_point(30);
    carving.set_point(31, {0.1f, 0.2f, 0.3f});
    carving.set_point(77, {0.3f, 0.1f, 0.2f});
    carving.carve_at_random(0.7, 99);
    const CarvingDelta good = carving.take_delta();
    CarvingDelta bad = good;
    hostile.write(&bad);
    EXPECT_EQ(complex.apply(bad), hostile.expected) << hostile.name;
    expect_valid(complex);
    EXPECT_TRUE(content(complex) == before) << hostile.name;
    EXPECT_EQ(complex.cell_limit(), limit_before) << hostile.name;
    EXPECT_EQ(complex.apply(good), ApplyResult::kOk) << hostile.name;
    expect_valid(complex);
  }
}

/// A snapshot takes another way in; it must be as strict and leave nothing behind.
TEST(CellComplex, RejectsHostileSnapshots) {
  DelaunayCarving carving = random_carving(60, 11);
  const CarvingDelta good = carving.take_delta();
  CellComplex intact;
  ASSERT_EQ(intact.apply(good), ApplyResult::kOk);
  for (const Hostile& hostile : hostile_deltas()) {
    CarvingDelta bad = good;
    hostile.write(&bad);
    CellComplex complex;
    if (bad.cells_removed.empty() && bad.vertices_removed.empty() &&
        hostile.expected != ApplyResult::kVertexInUse) {
      EXPECT_EQ(complex.apply(bad), hostile.expected) << hostile.name;
      EXPECT_EQ(complex.cell_count(), 0) << hostile.name;
      EXPECT_EQ(complex.vertex_count(), 0) << hostile.name;
      expect_valid(complex);
    }
    EXPECT_EQ(complex.apply(good), ApplyResult::kOk) << hostile.name;
    expect_valid(complex);
    EXPECT_TRUE(content(complex) == content(intact)) << hostile.name;
  }
  CarvingDelta doubled = good;
  doubled.cells_added.push_back(good.cells_added.front());
  doubled.cells_added.back().id = CellId(5000);
  CellComplex complex;
  const ApplyResult result = complex.apply(doubled);
  EXPECT_TRUE(result == ApplyResult::kCrowdedFacet || result == ApplyResult::kOverlappingCells);
  EXPECT_EQ(complex.cell_count(), 0);
}

TEST(CellComplex, LearnsTheEvidenceOfVertices) {
  CellComplex complex;
  CarvingDelta delta = one_tetrahedron();
  delta.vertices_set[1].evidence = {3, 0.5f};
  ASSERT_EQ(complex.apply(delta), ApplyResult::kOk);
  const auto evidence = [&](int32_t id) {
    return content(complex).begin()->second.evidence[VertexId(id)];
  };
  EXPECT_EQ(evidence(0), VertexEvidence{});
  EXPECT_EQ(evidence(1), (VertexEvidence{3, 0.5f}));
  CarvingDelta update;
  update.vertices_updated = {{VertexId(0), {2, 0.25f}}, {VertexId(1), {4, 0.75f}}};
  ASSERT_EQ(complex.apply(update), ApplyResult::kOk);
  EXPECT_EQ(evidence(0), (VertexEvidence{2, 0.25f}));
  EXPECT_EQ(evidence(1), (VertexEvidence{4, 0.75f}));
}

TEST(Confidence, GrowsWithNumberAndSpread) {
  EXPECT_EQ(confidence_of({}), 0);
  EXPECT_EQ(confidence_of({1, 0}), 0);
  EXPECT_EQ(confidence_of({5, 0}), 0) << "five rays from one place";
  EXPECT_NEAR(confidence_of({4, 0.02f}), 0.5, 1e-6) << "2 mrad / (0.02 · 2) = 5 %";
  EXPECT_GT(confidence_of({9, 0.02f}), confidence_of({4, 0.02f}));
  EXPECT_GT(confidence_of({4, 0.03f}), confidence_of({4, 0.02f}));
  EXPECT_GT(confidence_of({2, 0.5f}), 0.99);
}

TEST(CellComplex, RejectsBadGeometry) {
  CellComplex complex;
  ASSERT_EQ(complex.apply(one_tetrahedron()), ApplyResult::kOk);
  CarvingDelta below;
  below.vertices_set = vertices({{4, {0.2f, 0.2f, -1}}, {5, {0.3f, 0.3f, -2}}});
  below.cells_added = cells({{1, {0, 1, 2, 4}, 0}});
  EXPECT_EQ(complex.apply(below), ApplyResult::kInvertedCell);
  below.cells_added = cells({{1, {0, 2, 1, 4}, 0}, {2, {0, 2, 1, 5}, 0}});
  EXPECT_EQ(complex.apply(below), ApplyResult::kCrowdedFacet);
  CarvingDelta above;
  above.vertices_set = vertices({{4, {0.2f, 0.2f, 2}}});
  above.cells_added = cells({{1, {0, 1, 2, 4}, 0}});
  EXPECT_EQ(complex.apply(above), ApplyResult::kOverlappingCells);
  expect_valid(complex);
  EXPECT_EQ(complex.cell_count(), 1);
  EXPECT_EQ(complex.vertex_count(), 4);
}

/// Rounding positions to float may turn an almost flat cell over: that is no reason to fail.
TEST(CellComplex, AcceptsFlatCellsAsEmpty) {
  CarvingDelta delta = one_tetrahedron();
  delta.vertices_set[3].position_in_map = {0.3f, 0.3f, -1e-8f};
  CellComplex complex;
  ASSERT_EQ(complex.apply(delta), ApplyResult::kOk);
  EXPECT_EQ(complex.volume(CellId(0)), 0);
}

/// Shuffled, cut and bit-flipped deltas: whatever is accepted keeps every invariant.
TEST(CellComplex, SurvivesCorruptedDeltas) {
  std::mt19937 random(13);
  int accepted = 0, rejected = 0;
  for (int trial = 0; trial < 300; ++trial) {
    DelaunayCarving carving = random_carving(25, static_cast<uint32_t>(trial));
    CellComplex complex;
    ASSERT_EQ(complex.apply(carving.take_delta()), ApplyResult::kOk);
    for (int step = 0; step < 5; ++step) {
      carving.set_point(static_cast<int32_t>(random() % 40), random_point(&random));
      CarvingDelta delta = carving.take_delta();
      const auto corrupt = [&](auto& items, auto&& change) {
        if (!items.empty() && random() % 4 == 0) change(items[random() % items.size()]);
        if (!items.empty() && random() % 12 == 0) items.erase(items.begin());
      };
      const auto flip = [&]<class IdType>(IdType& id) {
        id = IdType(id.value() ^ 1 << random() % 32);
      };
      const auto flip_lowest = [](VertexId& id) { id = VertexId(id.value() ^ 1); };
      corrupt(delta.cells_removed, flip);
      corrupt(delta.vertices_set, [&](CarvingVertex& v) { flip(v.id); });
      corrupt(delta.cells_added, [&](CarvingCell& c) { flip_lowest(c.vertices[random() % 4]); });
      corrupt(delta.cells_added, [&](CarvingCell& c) { flip(c.id); });
      const ComplexContent before = content(complex);
      const ApplyResult result = complex.apply(delta);
      expect_valid(complex);
      if (result != ApplyResult::kOk) {
        EXPECT_TRUE(content(complex) == before);
      }
      (result == ApplyResult::kOk ? accepted : rejected) += 1;
    }
  }
  EXPECT_GT(accepted, 100);
  EXPECT_GT(rejected, 100);
}

TEST(CellComplex, EveryResultHasItsOwnText) {
  std::set<std::string_view> texts;
  for (int i = 0; i <= static_cast<int>(ApplyResult::kOverlappingCells); ++i) {
    texts.insert(to_string(static_cast<ApplyResult>(i)));
  }
  EXPECT_EQ(texts.size(), 14u);
}

}  // namespace
}  // namespace foresight
