// The visibility energy: its minimum, and what it makes of the votes of a real carver.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <vector>

#include "procs/carver/carver.h"
#include "procs/mesher/mesher.h"
#include "tests/mesher/delaunay_carving.h"
#include "tests/mesher/mesher_checks.h"

namespace foresight {
namespace {

using Eigen::Vector3d;

CarvingDelta with_random_votes(CarvingDelta delta, uint32_t seed) {
  std::mt19937 random(seed);
  const auto few = [&] { return static_cast<int32_t>(random() % 3); };
  for (CarvingCell& cell : delta.cells_added) {
    cell.votes = {};
    for (int32_t& n : cell.votes.entered) n = random() % 2 == 0 ? few() : 0;
    cell.votes.started = random() % 8 == 0 ? 1 : 0;
    cell.votes.ended = random() % 2 == 0 ? 2 * few() : 0;
    cell.constraints = cell.votes.started + static_cast<int32_t>(random() % 4 == 0);
    for (const int32_t n : cell.votes.entered) cell.constraints += n;
  }
  return delta;
}

/// The angle between a facet and its cell's circumsphere, from the sphere's equation.
double cosine(const CellComplex& complex, Slot slot) {
  std::array<Vector3d, 4> p;
  for (int32_t k = 0; k < 4; ++k) {
    p[static_cast<size_t>(k)] =
        complex.position_in_map(complex.vertex(slot_of(cell_of(slot), k))).cast<double>();
  }
  Eigen::Matrix3d rows;
  Vector3d right;
  for (int i = 0; i < 3; ++i) {
    const Vector3d& q = p[static_cast<size_t>(i + 1)];
    rows.row(i) = 2 * (q - p[0]).transpose();
    right[i] = q.squaredNorm() - p[0].squaredNorm();
  }
  const Vector3d centre = rows.fullPivLu().solve(right);
  const auto k = static_cast<size_t>(corner_of(slot));
  const Vector3d &a = p[(k + 1) % 4], &b = p[(k + 2) % 4], &c = p[(k + 3) % 4];
  Vector3d normal = (b - a).cross(c - a).normalized();
  if (normal.dot(p[k] - a) < 0) normal = -normal;  // towards the cell
  return normal.dot(centre - a) / (centre - p[0]).norm();
}

double energy(const CellComplex& complex, const VisibilityWeights& w, const auto& is_free) {
  double sum = 0;
  for (const CellId cell : complex.cells()) {
    const CellVotes& v = complex.votes(cell);
    int32_t by_facet = 0, crossed = 0;
    bool at_hull = false;
    for (int32_t k = 0; k < 4; ++k) {
      const Slot slot = slot_of(cell, k), twin = complex.twin(slot);
      by_facet += v.entered[static_cast<size_t>(k)];
      at_hull = at_hull || !complex.vertex_id(complex.vertex(slot)).is_point();
      if (!twin.is_valid()) {
        sum += is_free(cell) ? w.shape : 0;
        continue;
      }
      crossed += complex.constraints(cell_of(twin)) > 0;
      if (!is_free(cell) || is_free(cell_of(twin))) continue;
      sum += complex.votes(cell_of(twin)).entered[static_cast<size_t>(corner_of(twin))];
      sum += w.shape * (1 - std::min(cosine(complex, slot), cosine(complex, twin)));
    }
    const bool pocket = complex.constraints(cell) == 0 && !at_hull;
    const double share = crossed == 0 ? 0 : crossed == 1 ? 0.2 : crossed == 2 ? 1 : 2;
    if (is_free(cell)) {
      sum += w.surface * v.ended;
    } else {
      sum += v.started > 0 ? 1e9 : complex.constraints(cell) - by_facet;
      sum += pocket ? w.pocket * share : 0;
    }
  }
  return sum;
}

TEST(Visibility, FindsTheMinimumAmongAllLabelings) {
  const VisibilityWeights weights{.surface = 0.7, .shape = 0.6, .pocket = 0.3};
  int mixed = 0;
  for (uint32_t trial = 0; trial < 100; ++trial) {
    DelaunayCarving carving;
    std::mt19937 random(trial);
    std::uniform_real_distribution<float> coordinate(-1, 1);
    for (int32_t i = 0; i < 5 + static_cast<int32_t>(trial % 4); ++i) {
      const float x = coordinate(random), y = coordinate(random), z = coordinate(random);
      carving.set_point(i, {x, y, z});
    }
    const CarvingDelta delta = with_random_votes(carving.snapshot(), trial);
    const auto cells = static_cast<uint32_t>(delta.cells_added.size());
    if (cells > 14) continue;
    Mesher mesher({.visibility = weights});
    ASSERT_EQ(mesher.apply(delta), ApplyResult::kOk);
    mesher.update();
    double best = std::numeric_limits<double>::infinity();
    for (uint32_t labels = 0; labels < 1u << cells; ++labels) {
      const auto is_free = [&](CellId cell) { return (labels >> cell.value() & 1) == 1; };
      best = std::min(best, energy(mesher.complex(), weights, is_free));
    }
    const auto is_free = [&](CellId cell) { return mesher.carved()[cell] != 0; };
    EXPECT_NEAR(energy(mesher.complex(), weights, is_free), best, 1e-4) << "trial " << trial;
    const int32_t carved = mesher.statistics().carved_cells;
    mixed += carved > 0 && carved < static_cast<int32_t>(cells);
  }
  EXPECT_GT(mixed, 40);
}

/// The inside of a cube of edge 2, seen from cameras in it; some points are far off along the view.
MapDelta room(int points, double outliers, uint32_t seed, double scale = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  MapDelta map;
  std::vector<Vector3d> cameras;
  for (int32_t k = 0; k < 12; ++k) {
    cameras.push_back(0.6 * Vector3d(unit(random), unit(random), unit(random)));
    map.keyframes_set.push_back(
        {KeyframeId(k), {Eigen::Quaterniond::Identity(), scale * cameras.back()}, {}});
  }
  for (int32_t i = 0; i < points; ++i) {
    Vector3d p(unit(random), unit(random), unit(random));
    p[static_cast<int>(random() % 3)] = random() % 2 == 0 ? 1 : -1;
    const size_t first = random() % cameras.size();
    if (unit(random) < 2 * outliers - 1) {
      const double stretch = random() % 2 == 0 ? 0.4 : 1.6;
      p = cameras[first] + stretch * (p - cameras[first]);
    }
    map.points_set.push_back({PointId(i), (scale * p).cast<float>()});
    for (size_t n = 0; n < 5; ++n) {
      map.observations_added.push_back({KeyframeId::at((first + n) % cameras.size()), PointId(i)});
    }
  }
  return map;
}

struct Solved {
  Mesher mesher{MesherOptions{}};
  Mesh mesh;
};

Solved solve(const MapDelta& map, const MesherOptions& options) {
  Carver carver;
  Solved solved{Mesher(options), {}};
  EXPECT_EQ(solved.mesher.apply(carver.apply(map)), ApplyResult::kOk);
  solved.mesh = solved.mesher.update();
  return solved;
}

/// Mean distance from the walls, over the triangles' area.
double mean_error(const Mesh& mesh) {
  double sum = 0, area = 0;
  for (const auto& t : mesh.triangles) {
    std::array<Vector3d, 3> p;
    for (size_t j = 0; j < 3; ++j) {
      p[j] = mesh.vertices_in_map[static_cast<size_t>(t[j])].cast<double>();
    }
    const double a = (p[1] - p[0]).cross(p[2] - p[0]).norm() / 2;
    for (const Vector3d& corner : p) sum += a / 3 * std::abs(corner.cwiseAbs().maxCoeff() - 1);
    area += a;
  }
  return sum / area;
}

TEST(Visibility, OutliersDoNotRuinTheSurface) {
  const MapDelta map = room(1200, 0.04, 1);
  const Solved by_votes = solve(map, {});
  const Solved by_volume = solve(map, {.energy = Energy::kVolume});
  EXPECT_LT(mean_error(by_votes.mesh), 0.015);
  EXPECT_GT(mean_error(by_volume.mesh), 10 * mean_error(by_votes.mesh));
  EXPECT_EQ(find_problem(by_votes.mesh), "");
}

TEST(Visibility, IsTheSameAtEveryScaleOfTheMap) {
  const Solved unit = solve(room(500, 0.03, 2), {});
  ASSERT_GT(unit.mesh.triangles.size(), 400u);
  for (const double scale : {0x1p-10, 0x1p-3, 0x1p4, 0x1p10}) {
    EXPECT_EQ(solve(room(500, 0.03, 2, scale), {}).mesh.triangles, unit.mesh.triangles) << scale;
  }
  for (const double scale : {1e-3, 1e3}) {  // these round the positions
    const auto triangles =
        static_cast<double>(solve(room(500, 0.03, 2, scale), {}).mesh.triangles.size());
    EXPECT_NEAR(triangles, static_cast<double>(unit.mesh.triangles.size()), 6) << scale;
  }
}

TEST(Visibility, CamerasAreInTheOpen) {
  const MapDelta map = room(300, 0.2, 3);
  const Solved solved = solve(map, {});
  int32_t cameras = 0;
  for (const CellId cell : solved.mesher.complex().cells()) {
    if (!solved.mesher.complex().exists(cell)) continue;
    if (solved.mesher.complex().votes(cell).started == 0) continue;
    ++cameras;
    EXPECT_EQ(solved.mesher.carved()[cell], 1);
  }
  EXPECT_GE(cameras, 5);
}

TEST(Visibility, DeltasEqualFromScratch) {
  const MapDelta whole = room(400, 0.05, 4);
  Carver carver;
  Mesher mesher({});
  std::mt19937 random(4);
  for (size_t begin = 0; begin < whole.points_set.size(); begin += 40) {
    MapDelta delta;
    if (begin == 0) delta.keyframes_set = whole.keyframes_set;
    for (size_t i = begin; i < begin + 40; ++i) {
      delta.points_set.push_back(whole.points_set[i]);
      for (size_t n = 0; n < 5; ++n) {
        delta.observations_added.push_back(whole.observations_added[5 * i + n]);
      }
    }
    if (begin > 0) {
      delta.points_removed.push_back(PointId::at(begin - 7));
      MapPoint moved = whole.points_set[begin - 3];
      moved.position_in_map *= 0.98F;
      delta.points_set.push_back(moved);
      delta.observations_removed.push_back(whole.observations_added[5 * begin - 60]);
    }
    ASSERT_EQ(mesher.apply(carver.apply(delta)), ApplyResult::kOk);
    mesher.update();
    Mesher fresh({});
    ASSERT_EQ(fresh.apply(carver.snapshot()), ApplyResult::kOk);
    fresh.update();
    ASSERT_EQ(labels(mesher), labels(fresh)) << "after " << begin << " points";
  }
}

/// A receiver may be sent a hole: what was beside the cell is weighed anew, too.
TEST(Visibility, ARemovedCellLeavesNothingBehind) {
  Carver carver;
  Mesher mesher({});
  ASSERT_EQ(mesher.apply(carver.apply(room(300, 0.05, 5))), ApplyResult::kOk);
  mesher.update();
  CarvingDelta kept = carver.snapshot();
  for (size_t n = 0; n < 40; ++n) {
    const size_t victim = n * 7919 % kept.cells_added.size();
    CarvingDelta hole;
    hole.cells_removed.push_back(kept.cells_added[victim].id);
    kept.cells_added.erase(kept.cells_added.begin() + static_cast<std::ptrdiff_t>(victim));
    ASSERT_EQ(mesher.apply(hole), ApplyResult::kOk);
    mesher.update();
    Mesher fresh({});
    ASSERT_EQ(fresh.apply(kept), ApplyResult::kOk);
    fresh.update();
    ASSERT_EQ(labels(mesher), labels(fresh)) << n;
  }
}

TEST(Visibility, ARefusedDeltaChangesNothing) {
  Carver carver;
  Mesher mesher({});
  ASSERT_EQ(mesher.apply(carver.apply(room(300, 0.05, 6))), ApplyResult::kOk);
  const Mesh before = mesher.update();
  CarvingDelta bad;
  const CarvingDelta all = carver.snapshot();
  for (size_t i = 0; i < 50; ++i) {
    bad.cells_removed.push_back(all.cells_added[i].id);
    bad.cells_updated.push_back({all.cells_added[i + 50].id, 9, {{9, 0, 0, 0}, 0, 9}});
  }
  bad.cells_updated.push_back({all.cells_added[0].id, 1, {}});  // is gone by then
  ASSERT_NE(mesher.apply(bad), ApplyResult::kOk);
  EXPECT_EQ(mesher.update().triangles, before.triangles);
}

}  // namespace
}  // namespace foresight
