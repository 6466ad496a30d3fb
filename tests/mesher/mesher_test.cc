#include "procs/mesher/mesher.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tests/mesher/delaunay_carving.h"
#include "tests/mesher/mesher_checks.h"

namespace foresight {
namespace {

/// A hollow ball of points around a few cameras; every point is seen by all of them.
DelaunayCarving ball_carving(int32_t points, uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal(0, 1);
  const auto direction = [&] {
    const float x = normal(random), y = normal(random), z = normal(random);
    return Eigen::Vector3f(x, y, z).normalized();
  };
  DelaunayCarving carving;
  carving.add_hull_corners(20);
  std::vector<Eigen::Vector3f> seen;
  for (int32_t i = 0; i < points; ++i) {
    seen.push_back(direction() * (1 + 0.02f * normal(random)));
    carving.set_point(i, seen.back());
  }
  for (int camera = 0; camera < 2; ++camera) {
    const Eigen::Vector3f centre = 0.4f * direction();
    for (const auto& point : seen) carving.carve_segment(centre, point);
  }
  return carving;
}

DelaunayCarving random_carving(int32_t points, uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> coordinate(-1, 1);
  DelaunayCarving carving;
  for (int32_t i = 0; i < points; ++i) {
    const float x = coordinate(random), y = coordinate(random), z = coordinate(random);
    carving.set_point(i, {x, y, z});
  }
  carving.carve_at_random(0.5, seed);
  return carving;
}

CarvingDelta scaled(CarvingDelta delta, float factor) {
  for (CarvingVertex& vertex : delta.vertices_set) vertex.position_in_map *= factor;
  return delta;
}

/// Eq. (1) with everything outside the hull uncarved, term by term.
double energy(const CellComplex& complex, double lambda, int32_t min_constraints,
              const auto& is_carved) {
  double sum = 0;
  for (const Slot slot : complex.slots()) {
    const CellId cell = cell_of(slot);
    const Slot twin = complex.twin(slot);
    if (!complex.exists(cell)) continue;
    const bool input = complex.constraints(cell) >= min_constraints;
    if (corner_of(slot) == 0 && is_carved(cell) != input) sum += complex.volume(cell);
    const bool is_border = !twin.is_valid() || !is_carved(cell_of(twin));
    if (is_carved(cell) && is_border) sum += lambda * complex.area(slot);
  }
  return sum;
}

double energy_of_labels(const Mesher& mesher, double lambda, int32_t min_constraints) {
  return energy(mesher.complex(), lambda, min_constraints,
                [&](CellId cell) { return mesher.carved()[cell] != 0; });
}

double area_of(const Mesh& mesh) {
  double area = 0;
  for (const auto& t : mesh.triangles) {
    const auto p = [&](size_t j) {
      return Eigen::Vector3d(mesh.vertices_in_map[static_cast<size_t>(t[j])].cast<double>());
    };
    area += (p(1) - p(0)).cross(p(2) - p(0)).norm() / 2;
  }
  return area;
}

TEST(Mesher, EmptyComplexGivesAnEmptyMesh) {
  Mesher mesher({});
  const Mesh mesh = mesher.update();
  EXPECT_TRUE(mesh.triangles.empty());
  EXPECT_EQ(mesher.statistics().energy_mu3, 0);
}

TEST(Mesher, FindsTheMinimumOfEquationOneAmongAllLabelings) {
  int flipped = 0;
  for (uint32_t trial = 0; trial < 150; ++trial) {
    const CarvingDelta snapshot =
        random_carving(5 + static_cast<int32_t>(trial % 4), trial).snapshot();
    const auto cells = static_cast<uint32_t>(snapshot.cells_added.size());
    if (cells > 14) continue;
    const double lambda = 0.02 * (1 + trial % 8);
    const int32_t min_constraints = 1 + static_cast<int32_t>(trial % 3);
    Mesher mesher({.energy = Energy::kVolume,
                   .lambda = lambda,
                   .lambda_unit = LambdaUnit::kMapUnit,
                   .min_constraints = min_constraints});
    ASSERT_EQ(mesher.apply(snapshot), ApplyResult::kOk);
    const Mesh mesh = mesher.update();
    double best = std::numeric_limits<double>::infinity();
    for (uint32_t labels = 0; labels < 1u << cells; ++labels) {
      const auto is_carved = [&](CellId cell) { return (labels >> cell.value() & 1) == 1; };
      best = std::min(best, energy(mesher.complex(), lambda, min_constraints, is_carved));
    }
    const CutStatistics s = mesher.statistics();
    EXPECT_NEAR(energy_of_labels(mesher, lambda, min_constraints), best, 1e-9);
    EXPECT_NEAR(s.energy_mu3, best, 1e-9);
    EXPECT_NEAR(s.surface_area_mu2, area_of(mesh), 1e-5);
    EXPECT_EQ(s.cells, static_cast<int32_t>(cells));
    flipped += s.changed_cells;
  }
  EXPECT_GT(flipped, 100);
}

TEST(Mesher, ZeroLambdaKeepsTheCarving) {
  DelaunayCarving carving = ball_carving(400, 1);
  Mesher mesher({.energy = Energy::kVolume, .lambda = 0});
  ASSERT_EQ(mesher.apply(carving.take_delta()), ApplyResult::kOk);
  mesher.update();
  EXPECT_EQ(mesher.statistics().changed_cells, 0);
  EXPECT_GT(mesher.statistics().carved_cells, 100);
}

TEST(Mesher, LargerLambdaGivesLessArea) {
  DelaunayCarving carving = ball_carving(1500, 2);
  const CarvingDelta delta = carving.take_delta();
  double previous = std::numeric_limits<double>::infinity();
  for (const double lambda : {0.0, 0.001, 0.01, 0.1, 1.0, 100.0}) {
    Mesher mesher({.energy = Energy::kVolume, .lambda = lambda});
    ASSERT_EQ(mesher.apply(delta), ApplyResult::kOk);
    const Mesh mesh = mesher.update();
    EXPECT_EQ(find_problem(mesh), "");
    EXPECT_LE(mesher.statistics().surface_area_mu2, previous);
    previous = mesher.statistics().surface_area_mu2;
  }
  EXPECT_EQ(previous, 0);
}

TEST(Mesher, MinConstraintsIgnoresLonelyRays) {
  DelaunayCarving carving = ball_carving(300, 3);
  const CarvingDelta delta = carving.take_delta();
  int32_t expected = 0;
  for (const CarvingCell& cell : delta.cells_added) expected += cell.constraints >= 3;
  Mesher mesher({.energy = Energy::kVolume, .lambda = 0, .min_constraints = 3});
  ASSERT_EQ(mesher.apply(delta), ApplyResult::kOk);
  mesher.update();
  EXPECT_EQ(mesher.statistics().input_carved_cells, expected);
  EXPECT_EQ(mesher.statistics().carved_cells, expected);
  EXPECT_LT(expected, static_cast<int32_t>(delta.cells_added.size()));
}

/// Relative λ: the same labels at every scale of the map. Powers of ten round the positions; those
/// of two do not.
TEST(Mesher, LabelsDoNotDependOnTheScaleOfTheMap) {
  DelaunayCarving carving = ball_carving(2000, 4);
  const CarvingDelta delta = carving.take_delta();
  Mesher reference({.energy = Energy::kVolume, .lambda = 0.02});
  ASSERT_EQ(reference.apply(delta), ApplyResult::kOk);
  reference.update();
  EXPECT_GT(reference.statistics().changed_cells, 100);
  EXPECT_NEAR(reference.statistics().scene_size_mu, 1, 0.05);
  for (const float factor : {1e-3f, 1e-2f, 0x1p-10f, 0.1f, 10.f, 0x1p10f, 1e2f, 1e3f}) {
    Mesher mesher({.energy = Energy::kVolume, .lambda = 0.02});
    ASSERT_EQ(mesher.apply(scaled(delta, factor)), ApplyResult::kOk);
    mesher.update();
    EXPECT_EQ(mesher.carved(), reference.carved()) << "factor " << factor;
    EXPECT_NEAR(mesher.statistics().lambda_mu / reference.statistics().lambda_mu,
                static_cast<double>(factor), 1e-5 * static_cast<double>(factor));
  }
}

TEST(Mesher, MapUnitLambdaScalesWithTheMap) {
  DelaunayCarving carving = ball_carving(500, 5);
  const CarvingDelta delta = carving.take_delta();
  Mesher small({.energy = Energy::kVolume, .lambda = 0.02, .lambda_unit = LambdaUnit::kMapUnit});
  Mesher large(
      {.energy = Energy::kVolume, .lambda = 0.02 * 1024, .lambda_unit = LambdaUnit::kMapUnit});
  ASSERT_EQ(small.apply(delta), ApplyResult::kOk);
  ASSERT_EQ(large.apply(scaled(delta, 1024)), ApplyResult::kOk);
  small.update();
  large.update();
  EXPECT_EQ(small.carved(), large.carved());
}

TEST(Mesher, HugeHullDoesNotEatUpTheResolution) {
  std::vector<int32_t> changed;
  for (const float half_size : {20.f, 2e5f}) {
    DelaunayCarving carving;
    carving.add_hull_corners(half_size);
    std::mt19937 random(6);
    std::normal_distribution<float> normal(0, 1);
    for (int32_t i = 0; i < 800; ++i) {
      const float x = normal(random), y = normal(random), z = normal(random);
      carving.set_point(i, 0.5f * Eigen::Vector3f(x, y, z).normalized());
    }
    carving.carve_at_random(0.4, 6);
    Mesher mesher({.energy = Energy::kVolume, .lambda = 0.01, .lambda_unit = LambdaUnit::kMapUnit});
    ASSERT_EQ(mesher.apply(carving.snapshot()), ApplyResult::kOk);
    mesher.update();
    const double expected = energy_of_labels(mesher, 0.01, 1);
    EXPECT_NEAR(mesher.statistics().energy_mu3, expected, 1e-9 * expected);
    changed.push_back(mesher.statistics().changed_cells);
  }
  EXPECT_GT(changed[0], 100);
  EXPECT_NEAR(changed[1], changed[0], 0.2 * changed[0]);
}

/// The mesh after many deltas is the mesh of a mesher that got all of it at once.
TEST(Mesher, DeltasEqualFromScratch) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> coordinate(-1, 1);
  DelaunayCarving carving;
  carving.add_hull_corners(20);
  Mesher mesher({.energy = Energy::kVolume, .lambda = 0.01});
  for (int step = 0; step < 40; ++step) {
    for (int change = 0; change < 10; ++change) {
      const auto id = static_cast<int32_t>(random() % 200);
      const float x = coordinate(random), y = coordinate(random), z = coordinate(random);
      random() % 4 == 0 ? carving.remove_point(id) : carving.set_point(id, {x, y, z});
    }
    carving.carve_at_random(0.4, static_cast<uint32_t>(step));
    ASSERT_EQ(mesher.apply(carving.take_delta()), ApplyResult::kOk);
    const Mesh mesh = mesher.update();
    EXPECT_EQ(find_problem(mesh), "");
    Mesher fresh({.energy = Energy::kVolume, .lambda = 0.01});
    ASSERT_EQ(fresh.apply(carving.snapshot()), ApplyResult::kOk);
    const Mesh expected = fresh.update();
    EXPECT_EQ(mesh.triangles.size(), expected.triangles.size());
    const double energy = fresh.statistics().energy_mu3;
    EXPECT_NEAR(mesher.statistics().energy_mu3, energy, 1e-12 * energy);
    EXPECT_EQ(mesher.statistics().carved_cells, fresh.statistics().carved_cells);
  }
}

TEST(Mesher, SameInputGivesTheSameBytes) {
  DelaunayCarving carving = ball_carving(600, 8);
  const CarvingDelta delta = carving.take_delta();
  Mesher first({}), second({});
  ASSERT_EQ(first.apply(delta), ApplyResult::kOk);
  ASSERT_EQ(second.apply(delta), ApplyResult::kOk);
  first.update();
  const Mesh a = first.update(), b = second.update();  // updating twice changes nothing
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.vertex_ids, b.vertex_ids);
  EXPECT_TRUE(a.vertices_in_map == b.vertices_in_map);
}

TEST(Mesher, ResetForgetsEverything) {
  DelaunayCarving carving = ball_carving(100, 9);
  const CarvingDelta delta = carving.take_delta();
  Mesher mesher({});
  ASSERT_EQ(mesher.apply(delta), ApplyResult::kOk);
  EXPECT_NE(mesher.apply(delta), ApplyResult::kOk);
  mesher.reset();
  EXPECT_TRUE(mesher.update().triangles.empty());
  EXPECT_EQ(mesher.apply(delta), ApplyResult::kOk);
}

}  // namespace
}  // namespace foresight
